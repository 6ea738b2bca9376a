"""Empty cells of a thermometer that is asked more seldom than the gyro: filled in and said, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadFile
from labctl.recording import Recording
from labctl.recording.column_map import completed, parse_map, recording_of
from labctl.recording.logs.text import TextOptions, read_text

N, STEP_S = 1200, 0.5
ROWS = np.arange(N)
WARM_C = 20.0 + 0.01 * ROWS


def imported(tmp_path: Path, known: np.ndarray) -> Recording:
    """Return ten minutes at rest, with a temperature in the rows that are known, (N,)."""
    rng = np.random.default_rng(4)
    cells = [f"{value:.4f}" if there else "" for value, there in zip(WARM_C, known, strict=True)]
    lines = [f"{STEP_S * k:.1f},{0.2 + 0.01 * rng.normal():.6f},{cells[k]}" for k in ROWS]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time_s,gyro_z_dps,temperature_c", *lines]) + "\n")
    table = read_text(path, TextOptions())
    return recording_of(table, completed(table, parse_map("")).column_map).recording


def test_cells_between_readings_are_filled_in_and_the_recording_says_so(tmp_path: Path) -> None:
    recording = imported(tmp_path, ROWS % 20 == 5)
    warm = np.asarray(recording.columns["temperature_c"])
    np.testing.assert_allclose(warm[5:1186], WARM_C[5:1186], atol=1e-9)  # a straight line stays one
    assert (warm[:5] == WARM_C[5]).all()  # before the first reading the first one stands
    assert "temperature_c: 1140 of 1200 cells are empty" in recording.info.notes
    assert "at most 10 s apart" in recording.info.notes
    assert imported(tmp_path, ROWS >= 0).info.notes == ""


@pytest.mark.parametrize(
    ("known", "what"),
    [
        ((ROWS < 100) | (ROWS >= 500), r"rows 101, .*the thermometer was not read for 200.5 s"),
        (ROWS < 900, r"row.* 1142, .*the thermometer was not read for 150 s \(at most 120 s"),
        (ROWS == 3, "1199 of 1200 cells are empty; leave the column out of the map"),
    ],
)
def test_what_the_temperature_did_in_a_long_time_is_not_made_up(tmp_path: Path, known: np.ndarray, what: str) -> None:
    with pytest.raises(BadFile, match=what):
        imported(tmp_path, known)
