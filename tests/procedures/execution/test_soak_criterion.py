"""The judge of a soak, fed with readings of the bench by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from procedures.contracts.steps import Soak
from procedures.execution.soak_criterion import SoakCriterion

STEP = Soak(temperature_c=20, hold_s=600, band_c=0.5, max_drift_c=0.1, drift_window_s=300, timeout_s=5000)


def reported(chamber_c: list[float], gyro_c: list[float] | None = None, step: Soak = STEP) -> SoakCriterion:
    judge = SoakCriterion(step)
    for index, air_c in enumerate(chamber_c):
        judge.add(10.0 * index, air_c, {"imu": gyro_c[index]} if gyro_c else {})
    return judge


def test_it_ends_exactly_when_the_time_is_held() -> None:
    assert not reported([20.4] * 60).settled()
    assert reported([20.4] * 61).settled()
    assert reported([20.4] * 61).held_s == 600


def test_the_band_is_inclusive_and_has_two_sides() -> None:
    assert reported([20.5] * 61).settled()
    assert reported([19.5] * 61).settled()
    assert not reported([20.51] * 61).settled()
    assert not reported([19.49] * 61).settled()


def test_time_outside_does_not_count_and_leaving_starts_again() -> None:
    judge = reported([25.0] * 10 + [20.0] * 31 + [20.6] + [20.0] * 11)
    assert (judge.held_s, judge.restarts) == (100.0, 1)
    assert "for 100 s of 600 s, leaving the band 1 times" in judge.why_not()


def test_arriving_is_not_a_restart() -> None:
    assert reported([25.0] * 5 + [20.0] * 5).restarts == 0


def test_a_unit_that_still_follows_keeps_the_soak_open() -> None:
    lagging = [20 + 10 * math.exp(-10 * index / 720) for index in range(500)]  # 12 minutes behind the air
    index = next(n for n in range(61, 500) if reported([20.0] * n, lagging[:n]).settled())
    # the line's slope over the last window against the exponential's own: 10 K / 720 s x 300 s x exp(-t / 720 s)
    middle_s = 10 * (index - 1) - 150
    assert 300 * 10 / 720 * math.exp(-middle_s / 720) == pytest.approx(0.1, rel=0.05)
    assert "imu still changes by -" in reported([20.0] * 100, lagging[:100]).why_not()


def test_the_window_has_to_be_full_before_a_drift_is_believed() -> None:
    quick = Soak(temperature_c=20, hold_s=60, band_c=0.5, max_drift_c=0.1, drift_window_s=300, timeout_s=5000)
    assert not reported([20.0] * 30, [20.0] * 30, quick).settled()
    assert "not been monitored for 300 s yet" in reported([20.0] * 30, [20.0] * 30, quick).why_not()
    assert reported([20.0] * 31, [20.0] * 31, quick).settled()


def test_thermometer_noise_does_not_keep_a_soak_open() -> None:
    noise = np.random.default_rng(5).normal(0, 0.05, 200)
    judge = reported([20.0] * 200, [float(22 + each) for each in noise])
    assert judge.settled()
    drift_c = judge.drift_c()["imu"]
    assert drift_c is not None
    assert 0 < abs(drift_c) < 0.1


def test_every_unit_has_to_come_to_rest() -> None:
    judge = SoakCriterion(STEP)
    for index in range(100):
        judge.add(10.0 * index, 20.0, {"a": 20.0, "b": 20.0 + index / 100})
    assert not judge.settled()
    assert "b still changes by +0.30 deg C in 300 s" in judge.why_not()
    assert "a still" not in judge.why_not()


def test_figures_are_the_result() -> None:
    figures = reported([20.0] * 61, [21.0] * 61).figures()
    assert figures == {
        "held_s": 600.0,
        "band_c": 0.5,
        "drift_window_s": 300.0,
        "restarts": 0.0,
        "drift_c.imu": pytest.approx(0.0, abs=1e-12),
    }


def test_a_drift_is_allowed_up_to_its_limit() -> None:
    """A straight line of 0.1 deg C in the window, in numbers that the processor has exactly."""
    step = Soak(temperature_c=20, hold_s=60, band_c=0.5, max_drift_c=0.125, drift_window_s=320, timeout_s=5000)
    at_limit = [20 + index * 0.125 / 32 for index in range(33)]
    judge = reported([20.0] * 33, at_limit, step)
    assert judge.drift_c() == {"imu": 0.125}
    assert judge.settled()
    assert judge.why_not() == ""
    falling = reported([20.0] * 33, [40 - each for each in at_limit], step)
    assert falling.settled()
    beyond = reported([20.0] * 33, [20 + 1.01 * (each - 20) for each in at_limit], step)
    assert not beyond.settled()
    assert beyond.why_not() == "imu still changes by +0.13 deg C in 320 s, more than 0.125 deg C"


def test_only_the_last_window_counts() -> None:
    """What lies before the window has no part in the line through it."""
    settled = [30.0] * 40 + [20.0] * 31
    assert reported([20.0] * 71, settled).drift_c() == {"imu": 0.0}
    last_but_one = [30.0] * 40 + [20.0] * 30
    drift_c = reported([20.0] * 70, last_but_one).drift_c()["imu"]
    assert drift_c is not None
    assert drift_c < -0.1  # the reading at the begin of the window is one of it


def test_the_window_begins_at_its_first_reading_and_not_with_the_clock() -> None:
    judge = SoakCriterion(STEP)
    for index in range(30):
        judge.add(5000.0 + 10 * index, 20.0, {"imu": 20.0})
    assert judge.drift_c() == {"imu": None}
    judge.add(5300.0, 20.0, {"imu": 20.0})
    assert judge.drift_c() == {"imu": 0.0}


def test_polls_further_apart_than_the_window_make_a_line_of_two() -> None:
    step = Soak(temperature_c=20, hold_s=600, band_c=0.5, max_drift_c=0.1, drift_window_s=5, timeout_s=5000)
    judge = reported([20.0] * 61, [20.0] * 60 + [20.2], step)
    assert judge.drift_c() == {
        "imu": pytest.approx(0.1)
    }  # half of it: the window is half as long as the polls are apart
    assert not reported([20.0], [20.0], step).settled()
    assert reported([20.0], [20.0], step).drift_c() == {"imu": None}


def test_nothing_is_missing_once_the_time_is_held() -> None:
    assert reported([20.0] * 61).why_not() == ""
    assert reported([20.0] * 60).why_not() == "the air was within 0.5 deg C of 20 deg C for 590 s of 600 s"


def test_an_answer_before_the_time_is_held_is_no() -> None:
    assert reported([20.0] * 60).settled() is False
