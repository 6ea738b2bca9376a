"""N and B of a record at rest: one figure for `allan` and `criticise`, by every reading, as AllanTools has it."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import allantools
import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest
from labctl.recording import Recording, RecordingInfo
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.recordings.allan import allan_unit
from labctl.store import Store, open_store

AT = datetime(2027, 3, 1, 12, tzinfo=UTC)
RATE_HZ = 100.0
READINGS = 40_000
#: White noise of a reading, and of the second axis a line at 31.3 Hz beside it, deg/s.
WHITE_DPS, LINE_DPS, LINE_HZ = 0.1, 0.05, 31.3


def rates(seed: int, line_dps: float) -> np.ndarray:
    t_s = np.arange(READINGS) / RATE_HZ
    noise = np.random.default_rng(seed).normal(0.0, WHITE_DPS, READINGS)
    return np.asarray(noise + line_dps * np.sin(2 * np.pi * LINE_HZ * t_s))


def resting(seed: int) -> Recording:
    info = RecordingInfo(
        serial="MEMS-1", model="m", axes=("x", "z"), kind="samples", technology="mems", started_at=AT, motion="rest"
    )
    return Recording(info, {
        "dataset": np.ones(READINGS, dtype=np.int64), "t_s": np.arange(READINGS) / RATE_HZ,
        "position": np.full(READINGS, "z"), "table_rate_dps": np.zeros(READINGS),
        "temperature_c": np.full(READINGS, 25.0), "gyro_x": rates(seed, 0.0),
        "gyro_z": rates(seed + 1, LINE_DPS),
    })  # fmt: skip


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    path: Path = tmp_path_factory.mktemp("allan") / "lab.sqlite"
    with open_store(str(path), write=True) as opened:
        opened.recordings.add_import(resting(1), AT)
        opened.recordings.add_import(resting(11), AT)
        fit_unit(opened, "MEMS-1", FitRequest(model="bias"), AT)
        yield opened


def test_criticism_states_the_figures_of_the_allan_deviation(store: Store) -> None:
    noise = criticise_unit(store, "MEMS-1", None, 2).noise
    assert noise is not None
    found, stated = noise["static"], allan_unit(store, 2, None)
    assert found is not None
    for axis in ("x", "z"):
        assert found["axes"][axis] == stated.axes[axis]


@pytest.mark.parametrize(("axis", "seed", "line_dps"), [("x", 1, 0.0), ("z", 2, LINE_DPS)])
def test_n_is_that_of_allantools(store: Store, axis: str, seed: int, line_dps: float) -> None:
    n = allan_unit(store, 1, None).axes[axis]["N"]
    (tau,), (deviation,), _, _ = allantools.oadev(rates(seed, line_dps), rate=RATE_HZ, data_type="freq", taus=[0.32])
    assert n["value"] == pytest.approx(60 * deviation * np.sqrt(tau), rel=0.03)
    assert n["value"] == pytest.approx(60 * WHITE_DPS / np.sqrt(RATE_HZ), rel=0.03)


@pytest.mark.slow
def test_several_recordings_state_the_longest_record(store: Store) -> None:
    noise = criticise_unit(store, "MEMS-1", None, None, recordings=(1, 2)).noise
    assert noise is not None
    found = noise["static"]
    assert found is not None
    assert found["axes"]["x"]["N"]["value"] == allan_unit(store, 1, None).axes["x"]["N"]["value"]
    assert found["datasets"] == [1, 1]
