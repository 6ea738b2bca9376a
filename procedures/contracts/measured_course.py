"""A course of the table's rate as its encoder measured it: the commanded course, and by how much the table differs.

The angle is the commanded one plus a slowly changing offset and a delay, for a sweep also a slowly changing gain and
phase: the response of a servo to its demand. This model interpolates between the angles that were read, so that not
every period needs a reading.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from instruments.interfaces.rate_course import Ramp, RateCourse, SineSweep

Array = NDArray[np.float64]

#: Degrees of the polynomials in time, for the offset, and for gain and phase of a sweep.
OFFSET_DEGREE, GAIN_DEGREE = 5, 6
#: Steps by which derivatives are taken, s.
LATE_STEP_S = 1e-3


def regressors(course: RateCourse, since_s: Array) -> Array:
    """Return the regressors of the difference from the commanded angle, (n, k) deg, `since_s` (n,) after the start."""
    share = 2 * np.clip(since_s / course.duration_s, 0.0, 1.0) - 1
    offset = np.polynomial.chebyshev.chebvander(share, OFFSET_DEGREE)
    if isinstance(course, Ramp):
        return np.asarray(offset, dtype=np.float64)
    gain = np.polynomial.chebyshev.chebvander(share, GAIN_DEGREE)
    angle, ahead = course.angle_deg(since_s), course.quadrature_deg(since_s)
    parts = [offset, gain * angle[:, None], gain * ahead[:, None], course.rate_dps(since_s), _fading(course, since_s)]
    return np.asarray(np.column_stack(parts), dtype=np.float64)


def _fading(course: SineSweep, since_s: Array) -> Array:
    """Return the change of the angle by a delay of the fade-out, (n,) deg/s."""
    later = replace(course, late_s=course.late_s + LATE_STEP_S)
    return np.asarray((later.angle_deg(since_s) - course.angle_deg(since_s)) / LATE_STEP_S)


@dataclass(frozen=True)
class MeasuredCourse:
    """The angle of a table over a course of its rate."""

    course: RateCourse  #: as it was commanded
    began_s: float  #: campaign time
    coefficients: tuple[float, ...]  #: (k,) of the regressors

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle at times (n,), campaign time, as measured; unwrapped."""
        since_s = t_s - self.began_s
        correction_deg = regressors(self.course, since_s) @ np.array(self.coefficients)
        return np.asarray(self.course.angle_deg(since_s) + correction_deg)

    def rates_dps(self, t_s: Array, period_s: float) -> tuple[Array, Array]:
        """Return the measured and the commanded mean rates, (n,) each, over the periods that end at times (n,) s."""
        ends = np.concatenate([t_s - period_s, t_s])
        n = len(t_s)
        measured, commanded = self.angle_deg(ends), self.course.angle_deg(ends - self.began_s)
        return (measured[n:] - measured[:n]) / period_s, (commanded[n:] - commanded[:n]) / period_s

    def to_json(self) -> dict[str, object]:
        """Return it as a JSON document."""
        return {"course": asdict(self.course), "began_s": self.began_s, "coefficients": list(self.coefficients)}

    @classmethod
    def of_json(cls, document: Mapping[str, object]) -> MeasuredCourse:
        """Return what a JSON document says; raises ValueError for another one."""
        return _MEASURED.validate_python(dict(document))


_MEASURED = TypeAdapter(MeasuredCourse)
