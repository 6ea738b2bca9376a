"""Rows that are means at one rate each, in a file with a column of time, and rows that are readings of a motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.recording import Recording
from labctl.recording.column_map import completed, parse_map, propose, recording_of
from labctl.recording.logs.text import TextOptions, read_text

RATES_DPS = np.array([0.0, 10, -10, 100, -100, 300, -300])
TEMPERATURES_C = np.array([5.0, 25.0, 45.0])


def read(
    folder: Path, t_s: list[str], rate_dps: NDArray[np.float64], head: str = "time_s", toml: str = ""
) -> tuple[Recording, list[str]]:
    """Return the recording that is made of a file of one gyro on a table, and what was guessed."""
    warm_c = np.repeat(TEMPERATURES_C, -(-len(rate_dps) // len(TEMPERATURES_C)))[: len(rate_dps)]
    rows = zip(t_s, 1.003 * rate_dps, rate_dps, warm_c, strict=True)
    file = folder / "log.csv"
    lines = [f"{head},gyro_z_dps,table_rate_dps,temperature_degC", *(",".join(map(str, row)) for row in rows)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = read_text(file, TextOptions())
    proposal = completed(found, parse_map(toml)) if toml else propose(found)
    return recording_of(found, proposal.column_map).recording, proposal.guesses


@pytest.mark.parametrize("head", ["time_s", "time_ms", "time"])
def test_rates_that_jump_from_row_to_row_are_means(tmp_path: Path, head: str) -> None:
    rate_dps = np.tile(RATES_DPS, 3)
    seconds = 25 * np.arange(len(rate_dps)) + 1800 * (np.arange(len(rate_dps)) // 7)
    if head == "time":
        t_s = [str(np.datetime64("2026-03-01T08:00:00") + int(s)) for s in seconds]
    else:
        t_s = [str(s * (1000 if head == "time_ms" else 1)) for s in seconds]
    recording, guesses = read(tmp_path, t_s, rate_dps, head)
    assert (recording.info.kind, recording.info.motion) == ("points", "rates")
    assert len(np.unique(np.asarray(recording.columns["dataset"]))) == len(rate_dps)
    (text,) = [each for each in guesses if "means" in each]
    assert text == (
        "rows taken for means at constant rates (the rate jumps from row to row, 25 s apart); if they are readings, "
        'write kind = "samples" in the map'
    )


def test_a_map_may_say_that_they_are_readings(tmp_path: Path) -> None:
    t_s = [str(25 * k) for k in range(21)]
    recording, _ = read(tmp_path, t_s, np.tile(RATES_DPS, 3), toml='kind = "samples"\n')
    assert recording.info.kind == "samples"


@pytest.mark.parametrize(
    ("step_s", "rate_dps"),
    [
        (5.0, np.concatenate([np.linspace(-300, 300, 80), np.linspace(300, -300, 80)])),  # a slow ramp, logged slowly
        (5.0, np.repeat(RATES_DPS, 12)),  # a minute at each rate
        (0.1, np.tile(RATES_DPS, 12)),  # a motion faster than its log
    ],
)
def test_a_motion_that_the_log_follows_or_that_stands_at_rates_is_one_of_readings(
    tmp_path: Path, step_s: float, rate_dps: NDArray[np.float64]
) -> None:
    recording, guesses = read(tmp_path, [f"{step_s * k:.1f}" for k in range(len(rate_dps))], rate_dps)
    assert recording.info.kind == "samples"
    assert not [each for each in guesses if "means" in each]
