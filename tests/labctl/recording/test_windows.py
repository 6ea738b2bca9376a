"""Windows of a recording at rest: one data set may be a whole ramp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.recording import to_points
from labctl.recording.points import WINDOW_SHARE
from tests.helpers.rest import at_rest


def test_a_slow_ramp_is_taken_minute_by_minute() -> None:
    points = to_points(at_rest(("z",)))
    assert len(points) == 160
    assert np.asarray(points.columns["duration_s"]) == pytest.approx(60.0, rel=0.02)
    assert set(np.asarray(points.columns["dataset"]).tolist()) == {1}


def test_a_quick_warm_up_is_taken_in_shorter_windows() -> None:
    recording = at_rest(("z",), minutes=10.0)
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64)
    quick = replace(recording, columns={**recording.columns, "temperature_c": 40.0 - 30.0 * np.exp(-t_s / 120.0)})
    points = to_points(quick)
    warm = np.asarray(points.columns["temperature_c"], dtype=np.float64)
    assert len(points) > 10
    assert np.max(np.diff(warm)) < 1.4 * WINDOW_SHARE * np.ptp(warm)
    assert np.asarray(points.columns["n"]).min() >= 16


def test_without_a_thermometer_windows_go_by_time() -> None:
    assert len(to_points(at_rest(("z",), thermometer=False, minutes=30.0))) == 30
