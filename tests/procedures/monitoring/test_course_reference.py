"""The course fitted to an encoder's angles, against a servo that is integrated step by step with NumPy alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.interfaces.rate_course import Ramp, RateCourse, SineSweep, course_complaint
from instruments.interfaces.table import AngleReading, CourseRun
from procedures.contracts.errors import StepFailed, TableStopped
from procedures.contracts.measured_course import MeasuredCourse
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.course_reference import CourseLog

SWEEP = SineSweep(20.0, 0.2, 5.0, 40.0, 2.0)
STEP_S = 2e-4


def second_order(course: RateCourse, hz: float, late_s: float, gain: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and angles of a servo with a resonance at `hz`, damping 0.7, which hears its demand late."""
    t_s = np.arange(0.0, course.duration_s + 0.5, STEP_S)
    heard = t_s - late_s
    rate = np.where(heard >= 0, np.asarray(course.rate_dps(np.maximum(heard, 0.0))), course.begins_dps)
    w, state, speed, angles, angle = 2 * np.pi * hz, course.begins_dps, 0.0, [], 0.0
    for demand in (gain * rate).tolist():
        angles.append(angle)
        angle += STEP_S * state
        speed += STEP_S * (w * w * (demand - state) - 1.4 * w * speed)
        state += STEP_S * speed
    return t_s, np.array(angles)


def fitted(course: RateCourse, t_s: np.ndarray, angles: np.ndarray, *, noise_deg: float, every_s: float) -> Any:
    """Return what the log makes of noisy angles of an encoder, which were read with a jitter of 2 ms."""
    rng = np.random.default_rng(3)
    run = CourseRun(course, 100.0, 1e-4)
    log = CourseLog(SimpleNamespace(), "table", VirtualClock())  # type: ignore[arg-type]
    at = np.arange(0.01, course.duration_s, every_s)
    at = at + rng.uniform(0, 0.002, len(at))
    read = np.interp(at, t_s, angles) + noise_deg * rng.standard_normal(len(at)) + 77.0
    log.readings = [AngleReading(100.0 + t, angle, noise_deg, 1e-5, 1e-4) for t, angle in zip(at, read, strict=True)]
    time = CampaignTime(VirtualClock(), 0.0)
    return log.result(run, time, is_reference=True), time.of(100.0)


@pytest.mark.parametrize(("hz", "late_s", "gain"), [(200.0, 0.0, 1.0), (60.0, 0.004, 1.0), (25.0, 0.002, 1.001)])
def test_the_rate_between_few_angles_is_that_of_the_servo(hz: float, late_s: float, gain: float) -> None:
    """Angles are read ten times a second, a fraction of the fastest period: the shape of the course is known."""
    t_s, angles = second_order(SWEEP, hz, late_s, gain)
    found, zero_s = fitted(SWEEP, t_s, angles, noise_deg=1e-4, every_s=0.1)
    at = np.arange(1.0, 39.0, 0.01)
    true = (np.interp(at, t_s, angles) - np.interp(at - 0.01, t_s, angles)) / 0.01
    measured, commanded = found.course.rates_dps(at + zero_s, 0.01)
    off = measured - true
    assert float(np.sqrt(np.mean(off**2))) < 3 * found.rate_u_dps
    assert found.rate_u_dps < 0.02
    if hz < 100:
        assert np.abs(commanded - true).max() > 1.0  # what was asked for is no reference there
        assert np.abs(off).max() < 0.1


def test_a_ramp_that_begins_late_is_measured() -> None:
    ramp = Ramp(-30.0, 30.0, 20.0)
    t_s, angles = second_order(ramp, 40.0, 0.05, 1.0)
    found, zero_s = fitted(ramp, t_s, angles, noise_deg=3e-4, every_s=0.1)
    at = np.arange(0.5, 19.5, 0.1)
    true = (np.interp(at, t_s, angles) - np.interp(at - 0.1, t_s, angles)) / 0.1
    measured, commanded = found.course.rates_dps(at + zero_s, 0.1)
    assert commanded - true == pytest.approx(np.full(len(at), 3.0 * (0.05 + 1.4 / (2 * np.pi * 40))), abs=2e-3)
    assert np.abs(measured - true).max() < 0.01
    assert np.abs(measured - true).max() < 10 * found.rate_u_dps
    again = MeasuredCourse.of_json(found.course.to_json())
    assert again.angle_deg(at + zero_s) == pytest.approx(found.course.angle_deg(at + zero_s), abs=1e-12)


def test_a_servo_that_follows_another_course_is_no_reference() -> None:
    t_s, angles = second_order(SWEEP, 200.0, 0.0, 1.0)
    with pytest.raises(StepFailed, match="it does not follow this course"):
        fitted(SWEEP, t_s, np.clip(angles, -5, 5), noise_deg=1e-4, every_s=0.1)


def test_too_few_angles_and_a_table_that_stopped_are_said() -> None:
    t_s, angles = second_order(SWEEP, 200.0, 0.0, 1.0)
    with pytest.raises(StepFailed, match=r"was read 40 times during a sine of 20 deg/s .* 66 angles are needed"):
        fitted(SWEEP, t_s, angles, noise_deg=1e-4, every_s=1.0)
    table = SimpleNamespace(read_course_angle=lambda run: AngleReading(clock.now_s(), 0.0, 1e-4, 1e-4))
    clock = VirtualClock()
    run = CourseRun(Ramp(0.0, 30.0, 20.0), clock.now_s(), 1e-4)
    log = CourseLog(table, "table", clock)  # type: ignore[arg-type]

    def read_on() -> None:
        while True:
            log.read(run)
            clock.sleep(0.1)

    with pytest.raises(TableStopped, match="deg from where it was commanded"):
        read_on()
    assert clock.now_s() - run.began_s < 5.0


def test_limits_of_a_course_are_named_with_what_to_do() -> None:
    assert course_complaint(Ramp(-50, 50, 30), 100, 10) == ""
    assert "make it slower" in course_complaint(Ramp(-150, 50, 30), 100, 10)
    assert "make duration_s longer" in course_complaint(Ramp(-50, 50, 1), 100, 10)
    assert "needs 628.4" in course_complaint(SWEEP, 100, 500)
    assert "needs inf deg/s^2" in course_complaint(SineSweep(1, 1, 1, 10, 0.0), 100, 500)


@pytest.mark.slow
def test_the_angle_of_a_sweep_is_the_integral_of_its_rate() -> None:
    at = np.linspace(0.0, 42.0, 420_001)
    for course in (SWEEP, SineSweep(20.0, 5.0, 0.2, 40.0, 0.0), SineSweep(5.0, 1.0, 1.0, 40.0, 4.0, 0.35)):
        rate = course.rate_dps(at)
        angle = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * 1e-4)])
        inside = at < course.duration_s + course.late_s - 1e-3
        assert course.angle_deg(at)[inside] == pytest.approx(angle[inside], abs=2e-4)
