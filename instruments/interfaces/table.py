"""Interface of rate tables. Angles in degrees, rates in deg/s, positive counter-clockwise seen from above."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from instruments.errors import LimitError
from instruments.interfaces.rate_course import RateCourse

#: What a reference rate is known from: the table's own step clock, the rate that a servo was asked for, or its encoder.
Reference = Literal["computed", "demanded", "measured"]
#: By this share a rate may pass a limit that it was computed from.
ROUNDING = 1e-9
#: Standard uncertainties beyond its limit from which a figure is no chance.
COVERAGE = 3.0


@dataclass(frozen=True)
class TableLimits:
    """Limits of the table, from its bench file and its driver."""

    max_rate_dps: float
    max_acceleration_dps2: float
    step_deg: float  #: table angle of one motor step; 0 for a table without steps
    clock_run_s: float = 0.0  #: difference in duration of the runs that measure the step clock; 0: not measured
    clock_limit_ppm: float = 1000.0  #: expanded uncertainty of the measured step clock from which a plan is not run
    checks_home: bool = False  #: whether missed steps are looked for at the home switch
    reference: Reference = "computed"  #: what the rate of a data set is known from
    follows_courses: bool = False  #: whether it follows a rate that changes

    def require_rate(self, device: str, rate_dps: float) -> None:
        """Raise LimitError for a rate beyond the table's, deg/s; `device` is the name that the error gives."""
        if abs(rate_dps) > self.max_rate_dps * (1 + ROUNDING):
            raise LimitError(
                device,
                f"rate {rate_dps:g} deg/s is beyond the limit of the table, {self.max_rate_dps:g} deg/s; "
                "request a lower rate, or plan with --clip, which leaves such points out",
            )


@dataclass(frozen=True)
class StepClock:
    """The clock that a table's steps follow, as its bench file states it."""

    nominal_hz: float
    u_ppm: float  #: standard uncertainty


@dataclass(frozen=True)
class TimedRun:
    """A finished run of whole steps at constant rate between two ramps."""

    began_s: float  #: clock time
    duration_s: float  #: from the reply that accepted it to the reply that ended it, by the computer's clock
    steps: int  #: of the whole run, not signed
    step_hz: float  #: step rate of the steady part by the nominal clock

    @property
    def nominal_s(self) -> float:
        """Time that its steps take at the nominal step rate, s; ramps and replies come to it."""
        return self.steps / self.step_hz


def reply_time_u_s(duration_s: float) -> float:
    """Return the standard uncertainty of the middle between request and reply as the time of what was done, s.

    Controllers act as they take the request or as they make the reply, seldom half way: the error is U-shaped within
    half of the duration (JCGM 101, 6.4.6), and has the same sign in every reply.
    """
    return duration_s / math.sqrt(8.0)


@dataclass(frozen=True)
class AngleReading:
    """One reading of a table's encoder."""

    t_s: float  #: clock time
    angle_deg: float  #: unwrapped within a run
    u_deg: float  #: standard uncertainty of the angle against another one
    u_s: float  #: standard uncertainty of the time, without what all readings have in common
    common_u_s: float = 0.0  #: that of what they have in common: when between question and answer it was read


@dataclass(frozen=True)
class HomeCheck:
    """Where the table was when it should have been at home."""

    missed_steps: float  #: by the duration of the homing
    u_steps: float  #: its standard uncertainty, by the scatter of homings and the latency of replies
    limit_steps: float
    step_deg: float
    step_s: float  #: by how much each step away makes the homing longer
    learning: bool = False  #: whether they were missed in the turns that the check itself makes to learn from
    is_shown: bool = False  #: the controller said that the table still moved: no late reply explains them
    explained: str = ""  #: what shows that a reply was only late, for a person; empty: nothing does

    @property
    def doubt_steps(self) -> float:
        """So many steps are missing beyond doubt: the limit and `COVERAGE` standard uncertainties."""
        return self.limit_steps + COVERAGE * self.u_steps

    @property
    def is_missing(self) -> bool:
        """Whether steps were missed, beyond doubt."""
        return self.missed_steps > self.doubt_steps and not self.explained

    @property
    def is_doubtful(self) -> bool:
        """Whether more than the limit may be missing, or a reply was only late."""
        return self.missed_steps > self.limit_steps and not self.is_missing


@dataclass(frozen=True)
class Spin:
    """One run at constant rate: its steady part, and the table angle during it.

    `rate_dps` is the reference: the rate that the step timing gives. It is never the requested rate.
    """

    asked_dps: float  #: requested rate
    rate_dps: float
    steady_from_s: float  #: clock time
    steady_until_s: float
    angle_from_deg: float  #: unwrapped table angle at `steady_from_s`
    step_deg: float = 0.0

    def angle_deg(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unwrapped table angle, (n,) degrees, at clock times `t_s` (n,) inside the steady part."""
        return self.angle_from_deg + self.rate_dps * (t_s - self.steady_from_s)

    def gate(self, from_s: float, duration_s: float) -> tuple[float, float]:
        """Return the part of the steady run that starts and ends on step edges, (start_s, end_s) clock time.

        It starts no earlier than `from_s` and is at least `duration_s` long where the steady part allows it, so that
        steps inside the gate over gate time is exactly `rate_dps` (instruments notes, 1.3).
        """
        if self.step_deg == 0 or self.rate_dps == 0:
            return from_s, min(from_s + duration_s, self.steady_until_s)
        period_s = self.step_deg / abs(self.rate_dps)
        edge = np.ceil((from_s - self.steady_from_s) / period_s - 1e-9)
        start_s = self.steady_from_s + edge * period_s
        available = np.floor((self.steady_until_s - start_s) / period_s + 1e-9)
        steps = min(np.ceil(duration_s / period_s - 1e-9), available)
        return float(start_s), float(start_s + steps * period_s)


class RateTable(Protocol):
    """A single-axis rate table. Every failure is an InstrumentError."""

    name: str
    limits: TableLimits

    def identify(self) -> str:
        """Get the identity that the controller reports; raises WrongInstrument for another controller."""
        ...

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the achievable rate nearest to `rate_dps`, deg/s; raises LimitError beyond the table's limits."""
        ...

    def home(self) -> None:
        """Turn the table to its home switch; the angle is 0 deg there."""
        ...

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Turn the table at a constant rate that stays steady for at least `steady_s`; returns when it is steady.

        The table comes to rest by itself at the end of the run. Rate 0 is a run at rest.
        """
        ...

    def settle(self, spin: Spin) -> None:
        """Return when the table confirms that it is at rest."""
        ...

    def stop(self) -> None:
        """Stop the table. Safe to call at any time, also twice."""
        ...

    def is_moving(self) -> bool:
        """Get whether the table moves."""
        ...

    def angle_deg(self) -> float:
        """Get the unwrapped table angle since home, degrees."""
        ...

    def close(self) -> None:
        """Close the link. This does not stop the table."""
        ...


#: Lets seconds pass; may raise what ends the campaign.
Wait = Callable[[float], None]


@runtime_checkable
class OpenLoopTable(Protocol):
    """What a table without an encoder can find out about its own steps. Its limits say whether a plan asks for it."""

    step_clock: StepClock

    def time_run(self, rate_dps: float, steady_s: float, wait: Wait) -> TimedRun:
        """Turn at `rate_dps` by the nominal clock, steady for at least `steady_s`, and time it; `wait` passes time."""
        ...

    def use_step_clock(self, ratio: float) -> None:
        """Compute every later rate by a step clock that runs at `ratio` of the nominal one."""
        ...

    def check_home(self, wait: Wait) -> HomeCheck | None:
        """Measure whether steps were missed since home, and home; None where the position is not known."""
        ...


@runtime_checkable
class EncoderTable(Protocol):
    """A table that reads its own angle: the mean rate of a data set is measured."""

    rate_u_ppm: float  #: standard uncertainty of a computed rate, parts per million of it

    def read_angle(self) -> AngleReading:
        """Get the angle and when it was read; raises NoReply, MalformedReply or LinkError."""
        ...


@dataclass(frozen=True)
class CourseRun:
    """A course of the rate that a table follows, as it was commanded."""

    course: RateCourse
    began_s: float  #: clock time, the middle between command and reply
    u_s: float  #: standard uncertainty of `began_s`
    is_whole: bool = False  #: whether nothing is left to be commanded

    @property
    def ends_s(self) -> float:
        """When it is planned to end, clock time."""
        return self.began_s + self.course.duration_s


@runtime_checkable
class CourseTable(Protocol):
    """A table with an encoder that follows a rate which changes; its limits say so by `follows_courses`."""

    def begin_course(self, course: RateCourse) -> CourseRun:
        """Turn the table at the rate from which a course begins, then begin it.

        Raises LimitError (nothing was sent), RequestRejected, NoReply, MalformedReply, LinkError.
        """
        ...

    def continue_course(self, run: CourseRun) -> CourseRun:
        """Command what is due of a course; returns it as it was commanded so far. Call it often. Raises as above."""
        ...

    def read_course_angle(self, run: CourseRun) -> AngleReading:
        """Get the angle of the encoder, unwrapped since the course began; raises NoReply, MalformedReply, LinkError."""
        ...

    def end_course(self, run: CourseRun) -> None:
        """Stop the table at the end of a course; raises RequestRejected where it stopped before."""
        ...
