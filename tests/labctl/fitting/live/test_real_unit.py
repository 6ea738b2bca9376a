"""Readings of a real unit as a stream: an Xsens MTi that A. Pretto turned by hand (imu_tk, BSD licence)."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from numpy.typing import NDArray

from labctl.fitting import fit
from labctl.fitting.live import LiveCalibration, LiveState, Target
from labctl.recording import RecordingInfo
from labctl.recording.data_files import read_table
from tests.helpers.paths import EXAMPLES

INFO = RecordingInfo(
    serial="XSENS-IMUTK", axes=("x", "y", "z"), kind="samples", motion="poses",
    started_at=datetime(2014, 1, 1, tzinfo=UTC), latitude_deg=45.4,
)  # fmt: skip
#: Nominal words per deg/s and per g, and the word at zero, as examples/published/maps/xsens.toml has them.
GYRO, FORCE, GYRO_ZERO, FORCE_ZERO = 83.3333, 4070.0, 32768.0, 33000.0
#: Ends of blocks, s: while the unit still lies as at first, after 14 and 22 rests, and at the end.
ENDS_S = (40.0, 222.0, 300.0, 600.0)


@pytest.fixture(scope="module")
def stream() -> tuple[LiveCalibration, list[LiveState]]:
    gyro, force = (read_table(EXAMPLES / "published" / f"xsens_{name}.parquet") for name in ("gyro", "acc"))
    t_s = numbers(gyro, 0)
    columns = {f"gyro_{axis}": (numbers(gyro, k) - GYRO_ZERO) / GYRO for k, axis in enumerate("xyz", 1)}
    columns |= {f"accel_{axis}_g": (numbers(force, k) - FORCE_ZERO) / FORCE for k, axis in enumerate("xyz", 1)}
    live, states, begin = LiveCalibration(INFO, Target(u=2e-3, poses=12)), list[LiveState](), 0
    for end in np.searchsorted(t_s, ENDS_S):
        live.add({"t_s": t_s[begin:end], **{name: values[begin:end] for name, values in columns.items()}})
        states.append(live.assess(finally_=True))
        begin = end
    return live, states


def numbers(table: dict[str, NDArray[np.generic]], column: int) -> NDArray[np.float64]:
    return np.asarray(list(table.values())[column], dtype=np.float64)


def test_u_of_a_real_unit_falls_from_rest_to_rest(stream: tuple[LiveCalibration, list[LiveState]]) -> None:
    _, states = stream
    assert states[0].rests == 1
    assert states[0].coefficients == ()
    assert states[-1].rests == 38
    largest = [state.worst.expanded for state in states if state.worst is not None]
    assert len(largest) == 3
    assert largest[0] > largest[1] > largest[2]
    assert largest[0] > 2e-3
    assert largest[2] < 1e-3
    assert states[1].turns_left is not None
    assert 0 < states[1].turns_left < 10
    assert states[-1].turns_left == 0


def test_it_ends_as_the_fit_of_the_recording(stream: tuple[LiveCalibration, list[LiveState]]) -> None:
    live, states = stream
    fitted = fit(live.recording, "poses").fitted.axes
    for each in states[-1].coefficients:
        place = fitted[each.axis].names.index(each.name)
        assert (each.value, each.expanded) == (fitted[each.axis].values[place, 0], 2 * fitted[each.axis].u[place, 0])


def test_only_poses_are_missing_that_its_owner_was_not_asked_for(
    stream: tuple[LiveCalibration, list[LiveState]],
) -> None:
    _, states = stream
    (missing,) = states[-1].missing
    assert missing.startswith(f"{12 - len(states[-1].covered)} of 12 poses are missing")
    assert states[-1].request is not None
    assert states[-1].request.pose.name not in states[-1].covered
