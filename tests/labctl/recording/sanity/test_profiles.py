"""Recordings whose rate changes: sign, unit and axes are judged, a delay is no error, and no data set has one rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.recording import Recording
from labctl.recording.sanity import inspect_recording
from tests.helpers.profiles import profile_recording, ramp, sweep

SWEEP = sweep(60.0, 0.1, 10.0, 50.0, 100.0)


def scaled(recording: Recording, factor: float) -> Recording:
    """Return a recording whose output is multiplied."""
    gyro = factor * np.asarray(recording.columns["gyro_z"], dtype=np.float64)
    return replace(recording, columns={**recording.columns, "gyro_z": gyro})


@pytest.mark.parametrize("delay_s", [0.0, 0.005, 0.05, 0.12])
def test_a_sound_sweep_has_no_findings_however_late_it_is(delay_s: float) -> None:
    assert inspect_recording(profile_recording(SWEEP, delay_s=delay_s, bandwidth_hz=40.0)) == []


def test_a_sound_ramp_has_no_findings() -> None:
    assert inspect_recording(profile_recording(ramp(60.0, 0.0, 60.0, 100.0))) == []


@pytest.mark.parametrize(("factor", "what"), [(-1.0, "sign"), (np.pi / 180, "unit"), (37.0, "scale")])
def test_a_wrong_sign_unit_or_scale_is_found(factor: float, what: str) -> None:
    found = inspect_recording(scaled(profile_recording(SWEEP, delay_s=0.005), factor))
    assert [(each.what, each.severity) for each in found] == [(what, "certain")]


def test_exchanged_axes_are_found() -> None:
    one = profile_recording(SWEEP)
    noise = np.random.default_rng(3).normal(0.0, 0.02, len(one))
    info = one.info.model_copy(update={"axes": ("x", "z")})
    columns = {**one.columns, "gyro_x": one.columns["gyro_z"], "gyro_z": noise}
    assert [each.what for each in inspect_recording(Recording(info, columns))] == ["axes"]
