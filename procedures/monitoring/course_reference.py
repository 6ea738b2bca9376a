"""The rate over a course by the table's encoder: the angles that were read, and what is fitted to them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.errors import NoReply
from instruments.interfaces.table import AngleReading, CourseRun, CourseTable, RateTable
from procedures.contracts.errors import StepFailed, TableStopped
from procedures.contracts.journal import CourseTime, Event, TableAngles
from procedures.contracts.measured_course import MeasuredCourse, regressors
from procedures.monitoring.campaign_time import CampaignTime

Array = NDArray[np.float64]

#: Largest number of consecutive lost replies.
MAX_LOST = 2
#: Least number of angles for each fitted coefficient.
MIN_ANGLES_EACH = 3
#: Limit of the difference from the commanded angle, deg, plus a share of the angle turned; above it the table stopped.
STOPPED_DEG, STOPPED_SHARE = 5.0, 0.05
#: Largest ratio of the scatter of the angles about the fit to their uncertainty.
MAX_EXCESS = 5.0
#: A difference between measured and commanded rate above this share of the largest rate is reported.
REPORTED_SHARE = 0.02
#: Smallest singular value that is used, as a share of the largest: a ramp does not separate a delay from an offset.
RCOND = 1e-9
#: Points of a course at which the uncertainty of its rate is computed, and the time over which a rate is taken, s.
POINTS, RATE_OVER_S = 400, 0.01


class CourseLog:
    """The angles of one course, as they are read."""

    def __init__(self, table: CourseTable, name: str, clock: Clock) -> None:
        self._table, self._name, self._clock = table, name, clock
        self._lost = 0
        self.readings: list[AngleReading] = []

    def read(self, run: CourseRun) -> None:
        """Read the angle now. Raises NoReply after several lost replies, LinkError, TableStopped."""
        try:
            reading = self._table.read_course_angle(run)
        except NoReply:
            self._lost += 1
            if self._lost > MAX_LOST:
                raise
            return
        self._lost = 0
        self.readings.append(reading)
        times = np.array([self.readings[0].t_s, reading.t_s]) - run.began_s
        expected_deg = float(np.diff(run.course.angle_deg(times))[0])
        off_deg = abs(reading.angle_deg - self.readings[0].angle_deg - expected_deg)
        limit_deg = STOPPED_DEG + STOPPED_SHARE * run.course.largest_dps * abs(float(times[1] - times[0]))
        if off_deg > limit_deg:
            raise TableStopped(
                f"{self._name}: {off_deg:.2f} deg from where it was commanded (limit {limit_deg:.2f} deg) "
                f"{times[1]:.1f} s after a {run.course.text} began; check motor, load and limits, and home the table"
            )

    def result(self, run: CourseRun, time: CampaignTime, *, is_reference: bool) -> TableAngles:
        """Return the angles in campaign time and the course fitted to them.

        Raises StepFailed for too few angles, and for angles that do not follow the course.
        """
        t_s = np.array([reading.t_s for reading in self.readings])
        needed = MIN_ANGLES_EACH * regressors(run.course, np.zeros(1)).shape[1]
        if len(t_s) < needed:
            raise StepFailed(
                f"{self._name}: its encoder was read {len(t_s)} times during a {run.course.text}, but {needed} angles "
                "are needed; make it longer, or check the link"
            )
        angle_deg = np.array([reading.angle_deg for reading in self.readings])
        since_s = t_s - run.began_s
        own_dps = np.abs(run.course.rate_dps(since_s))
        u_deg = np.hypot(
            [reading.u_deg for reading in self.readings], own_dps * [reading.u_s for reading in self.readings]
        )
        design = regressors(run.course, since_s)
        fitted, covariance, excess = _fitted(design, angle_deg - run.course.angle_deg(since_s), u_deg)
        if excess > MAX_EXCESS:
            raise StepFailed(
                f"{self._name}: the angles of its encoder scatter by {excess:.1f} times their uncertainty about a "
                f"{run.course.text} (limit {MAX_EXCESS:g}): it does not follow this course; check load and tuning, or "
                "make the course slower"
            )
        measured = MeasuredCourse(run.course, time.of(run.began_s), tuple(fitted.tolist()))
        ends = measured.angle_deg(np.asarray(time.of(np.array([run.began_s, run.ends_s]))))
        mean_dps = float(ends[1] - ends[0]) / run.course.duration_s
        commanded = run.course.angle_deg(np.array([run.course.duration_s]))
        common_u_s = float(
            np.mean([reading.common_u_s for reading in self.readings])
        )  # as early or late in each answer
        by_encoder = CourseTime(_time_u_s(run, covariance), common_u_s)
        return TableAngles(
            tuple(np.asarray(time.of(t_s)).tolist()), tuple(angle_deg.tolist()), mean_dps,
            _rate_u_dps(run, covariance, common_u_s), float(ends[0]), float(commanded[0]) / run.course.duration_s,
            is_reference=is_reference, course=measured,
            # when a command takes effect is known by its reply alone, and is as late in every data set
            time=by_encoder if is_reference else CourseTime(0.0, run.u_s),
        )  # fmt: skip


def _fitted(design: Array, values: Array, u: Array) -> tuple[Array, Array, float]:
    """Return coefficients (k,), their covariance (k, k) and the excess of the scatter over the uncertainties, >= 1."""
    scale = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    weighted = design / scale / u[:, None]
    inverse = np.linalg.pinv(weighted, rcond=RCOND)
    coefficients = inverse @ (values / u)
    left = values / u - weighted @ coefficients
    freedom = max(len(values) - np.linalg.matrix_rank(weighted), 1)
    excess = math.sqrt(max(float(np.sum(left**2)) / freedom, 1.0))
    return coefficients / scale, excess**2 * (inverse @ inverse.T) / np.outer(scale, scale), excess


def _rates(run: CourseRun) -> tuple[Array, Array]:
    """Return the derivatives of the rate by the coefficients, (n, k) deg/s, and its slope, (n,) deg/s^2."""
    at = np.linspace(RATE_OVER_S, run.course.duration_s, POINTS)
    change = (regressors(run.course, at) - regressors(run.course, at - RATE_OVER_S)) / RATE_OVER_S
    slope = (run.course.rate_dps(at) - run.course.rate_dps(at - RATE_OVER_S)) / RATE_OVER_S
    return change, np.asarray(slope)


def _rate_u_dps(run: CourseRun, covariance: Array, common_u_s: float) -> float:
    """Return the standard uncertainty of the rate, deg/s: the root mean square over the course.

    By the scatter of the angles, and by the time that all of them have in common.
    """
    change, slope = _rates(run)
    by_scatter = np.einsum("nk,kl,nl->n", change, covariance, change)
    return math.sqrt(float(np.mean(np.maximum(by_scatter, 0.0) + (slope * common_u_s) ** 2)))


def _time_u_s(run: CourseRun, covariance: Array) -> float:
    """Return the standard uncertainty of the time of a course by the scatter of its angles, s.

    Its error is the one delay that takes most of an error of the rate, by least squares: a delay of 1 s adds minus the
    slope of the rate. 0 where the rate never changes.
    """
    change, slope = _rates(run)
    along = slope @ change / max(float(slope @ slope), 1e-300)
    return math.sqrt(max(float(along @ covariance @ along), 0.0))


def course_event(table: RateTable, angles: TableAngles, course: MeasuredCourse, duration_s: float) -> Event | None:
    """Return a warning where the measured rate differs from the commanded one by more than a share of the largest."""
    at = course.began_s + np.linspace(RATE_OVER_S, duration_s, POINTS)
    measured, commanded = course.rates_dps(at, RATE_OVER_S)
    off_dps, limit_dps = float(np.abs(measured - commanded).max()), REPORTED_SHARE * course.course.largest_dps
    if off_dps <= limit_dps:
        return None
    used = "the encoder is the reference" if angles.is_reference else "the commanded rate is the reference"
    text = (
        f"{table.name}: during a {course.course.text} its encoder measures up to {off_dps:.3g} deg/s more or less than "
        f"was commanded (limit of this message {limit_dps:.3g} deg/s, u {angles.rate_u_dps:.2g} deg/s); {used}"
    )
    return Event("table_course", text, level="warning", device=table.name, value=off_dps, limit=limit_dps, unit="deg/s")
