"""Servo table on an ACUTROL 3000: rates by its rate mode, the angle by its encoder, interlocks and limits by status.

A run lasts until it is ended: the table has no finite moves at a rate. A stop is its Off mode, a controlled stop that
then holds the table at rest.
"""

from __future__ import annotations

import math

from instruments.clock import Clock, sleep_until
from instruments.drivers.acutrol3000 import checks
from instruments.drivers.acutrol3000.course import CourseFollower
from instruments.drivers.acutrol3000.link import AcutrolLink
from instruments.drivers.driver import TableDriver
from instruments.errors import LimitError, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.rate_course import RateCourse, course_complaint
from instruments.interfaces.table import AngleReading, CourseRun, Spin, TableLimits, reply_time_u_s
from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings
from instruments.transport.factory import Ports

POLL_S = 0.2
#: A motion may last this much longer than computed, s and share: the controller has its own jerk limits and filters.
END_TOLERANCE_S, END_TOLERANCE_SHARE = 10.0, 0.5
#: In a run the table stays at its rate for at least this much longer than requested, s.
SPARE_S = 0.5
#: The table is home when it is this near, degrees.
HOME_DEG = 0.01
#: An angle is asked for this often, and the quickest answer is used, where answers come within this time, s: the time
#: of the quickest answer is the least uncertain.
QUESTIONS, QUICK_S = 3, 0.02
MODES = (acl.RATE, acl.POSITION, acl.OFF, acl.SYNTHESIS)


class Acutrol3000:
    """Driver of one axis of an ACUTROL 3000."""

    def __init__(self, settings: Acutrol3000Settings, ports: Ports, clock: Clock) -> None:
        self.name = "table"
        self.settings = settings
        self.limits = TableLimits(
            settings.max_rate_dps, settings.acceleration_dps2, 0.0, reference=settings.reference, follows_courses=True
        )
        self.rate_u_ppm = settings.rate_u_ppm
        self._clock = clock
        self._link = AcutrolLink(self.name, settings, ports, clock, self._forget)
        self._courses = CourseFollower(self.name, settings, self._link, clock)
        self._ready = False  #: whether limits were set and the interlock was found closed since the link is open
        self._rate_dps = 0.0  #: of the run that is under way
        self._last: AngleReading | None = None
        self._quickest_s = math.inf  #: shortest time from a question to its answer

    def identify(self) -> str:
        """Get manufacturer, model, serial number and software; raises WrongInstrument.

        WrongInstrument also stands for limits of the bench file above those of the controller. Raises NoReply,
        MalformedReply, LinkError.
        """
        text = self._link.ask(acl.IDENTIFY)
        if not any(word in text.lower() for word in acl.IDENTITY):
            raise WrongInstrument(
                self.name,
                f"{self._link.url} answered {text!r}, which is not the answer of an ACUTROL 3000; check the address",
            )
        checks.check_factory_limits(self.name, self.settings, self._numbers(f":Limit:Absolute? {self._axis}", 2))
        return text

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the rate that is demanded for `rate_dps`, deg/s; raises LimitError."""
        self.limits.require_rate(self.name, rate_dps)
        return round(rate_dps, acl.DECIMALS)

    def home(self) -> None:
        """Turn the table to the zero of its encoder, by the shorter way.

        Raises RequestRejected for an open interlock that does not close, NoReply, MalformedReply, LinkError.
        """
        self._prepare()
        self._come_to_rest()
        self._link.ask(acl.demand_position(self._axis, 0.0))
        longest_s = 180.0 / self._home_dps + self._ramp_s(self._home_dps)
        deadline_s = self._clock.now_s() + self._tolerated_s(longest_s)
        while True:
            angle_deg, rate_dps = self._numbers(f":Read:Position? {self._axis};Rate? {self._axis}", 2)
            if abs((angle_deg + 180) % 360 - 180) <= HOME_DEG and abs(rate_dps) <= self.settings.still_dps:
                return
            self._demand_time(
                deadline_s, f"stands at {angle_deg:.4f} deg after homing instead of at 0 deg (limit {HOME_DEG:g} deg)"
            )
            self._clock.sleep(POLL_S)

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Turn the table at a constant rate, deg/s, for at least `steady_s` seconds; returns when it is steady.

        Raises LimitError (nothing was sent), RequestRejected, NoReply, MalformedReply, LinkError.
        """
        demand_dps = self.achievable_dps(rate_dps)
        self._prepare()
        self._rate_dps, self._last = demand_dps, None
        if demand_dps == 0:
            self._come_to_rest()
        else:
            self._link.ask(acl.demand_rate(self._axis, self.settings.direction * demand_dps))
            ramp_s = self._ramp_s(demand_dps)
            sleep_until(self._clock, self._clock.now_s() + ramp_s)
            self._await_rate(demand_dps, self._clock.now_s() + self._tolerated_s(ramp_s))
        angle_deg = self.read_angle()
        return Spin(rate_dps, demand_dps, angle_deg.t_s, self._clock.now_s() + steady_s + SPARE_S, angle_deg.angle_deg)

    def settle(self, spin: Spin) -> None:
        """Stop the table and return when it is at rest.

        Raises RequestRejected where it stopped by itself before, NoReply, MalformedReply, LinkError.
        """
        if spin.rate_dps == 0:
            return
        moved = self.is_moving()
        self._come_to_rest()
        if not moved:
            raise RequestRejected(
                self.name,
                f"stopped during a run at {spin.rate_dps:g} deg/s{self._cause()}; check the load, then home the table",
            )

    def begin_course(self, course: RateCourse) -> CourseRun:
        """Turn the table at the rate from which a course begins, then begin it.

        Raises LimitError (nothing was sent), RequestRejected, NoReply, MalformedReply, LinkError.
        """
        if complaint := course_complaint(course, self.limits.max_rate_dps, self.limits.max_acceleration_dps2):
            raise LimitError(self.name, f"a {course.text} {complaint}; change it in the [[profiles]] of the recipe")
        self._courses.check(course)
        self.spin(course.begins_dps, 0.0)
        self._rate_dps, self._ready = 0.0, False  # its rate passes zero, and a ramp is a limit
        return self._courses.begin(course)

    def continue_course(self, run: CourseRun) -> CourseRun:
        """Command the fade-out of a sweep once it is due; raises as `begin_course` does."""
        return self._courses.go_on(run)

    def read_course_angle(self, run: CourseRun) -> AngleReading:
        """Get the angle of the encoder, unwrapped since the course began; raises NoReply, MalformedReply, LinkError."""
        return self._courses.angle(run)

    def end_course(self, run: CourseRun) -> None:
        """Stop the table and set the limits of constant rates again.

        Raises RequestRejected where an interlock ended the course, NoReply, MalformedReply, LinkError.
        """
        self._courses.demand_closed(run.course)
        self._come_to_rest()
        self._prepare()

    def stop(self) -> None:
        """Stop the table (Off mode). The command is sent before anything is read; raises LinkError."""
        self._rate_dps, self._last = 0.0, None
        self._link.send_stop(acl.off(self._axis))

    def is_moving(self) -> bool:
        """Get whether the table moves, by its estimated rate.

        The limit is `still_dps`, or half of the demanded rate during a slow run, which may be below the noise at rest.
        Raises RequestRejected where an interlock ended a run, NoReply, MalformedReply, LinkError.
        """
        (rate_dps,) = self._numbers(f":Read:Rate? {self._axis}", 1)
        limit_dps = self.settings.still_dps
        if self._rate_dps:
            limit_dps = min(limit_dps, 0.5 * abs(self._rate_dps))
        moves = abs(rate_dps) > limit_dps
        if self._rate_dps and not moves and (cause := self._cause()):
            raise RequestRejected(
                self.name,
                f"stopped during a run at {self._rate_dps:g} deg/s{cause}; check load and interlocks, then home "
                "the table",
            )
        return moves

    def angle_deg(self) -> float:
        """Get the angle of the encoder, degrees, unwrapped during a run; raises NoReply, MalformedReply, LinkError."""
        return self.read_angle().angle_deg

    def read_angle(self) -> AngleReading:
        """Get the angle of the encoder, and the middle between question and answer as its time.

        The quickest of a few answers is used. The angle is unwrapped from the reading before by the demanded rate. The
        uncertainty of the time grows with the delay of the answer beyond that of the quickest answer so far. Raises
        NoReply, MalformedReply, LinkError.
        """
        text, sent_s, answered_s = self._quickest_answer(f":Read:Position? {self._axis}")
        t_s = (sent_s + answered_s) / 2
        angle_deg = self.settings.direction * checks.numbers(self.name, text, 1)[0]
        if self._last is not None:
            expected_deg = self._last.angle_deg + self._rate_dps * (t_s - self._last.t_s)
            angle_deg += 360.0 * round((expected_deg - angle_deg) / 360.0)
        self._quickest_s = min(self._quickest_s, answered_s - sent_s)
        u_s = math.hypot(self.settings.time_u_s, (answered_s - sent_s - self._quickest_s) / math.sqrt(12))
        self._last = AngleReading(t_s, angle_deg, self.settings.encoder_u_deg, u_s, reply_time_u_s(answered_s - sent_s))
        return self._last

    def close(self) -> None:
        """Close the link; safe to call twice. The table goes on as commanded."""
        self._link.close()

    @property
    def _axis(self) -> int:
        return self.settings.axis

    @property
    def _home_dps(self) -> float:
        return min(self.settings.home_dps, self.settings.max_rate_dps)

    def _forget(self) -> None:
        """All is checked and set again over a new link: the controller may have lost its power."""
        self._ready, self._last, self._quickest_s = False, None, math.inf

    def _prepare(self) -> None:
        """Close the interlock and set the limits, once for each opening of the link."""
        if not self._ready:
            checks.close_interlock(self.name, self.settings, self._link, self._clock)
            self._set_limits()
            self._ready = True

    def _set_limits(self) -> None:
        """Set the limits of the modes that are used, and read those of rate mode back."""
        acceleration = self.settings.acceleration_dps2
        for mode in MODES:
            self._link.ask(acl.limit_acceleration(mode, self._axis, acceleration))
        self._link.ask(acl.limit_rate(acl.POSITION, self._axis, self._home_dps))
        self._link.ask(acl.limit_rate(acl.RATE, self._axis, self.settings.max_rate_dps))
        for name, expected in (("Rate", self.settings.max_rate_dps), ("Acceleration", acceleration)):
            (limit,) = self._numbers(f":Limit:{name}? {acl.RATE},{self._axis}", 1)
            if not math.isclose(limit, expected, rel_tol=1e-4):
                raise RequestRejected(
                    self.name,
                    f"limits the {name.lower()} to {limit:g}, but labctl set {expected:g}; query :Limit:Absolute? "
                    "of the controller, then correct max_rate_dps and acceleration_dps2 in the bench file",
                )

    def _await_rate(self, rate_dps: float, deadline_s: float) -> None:
        """Wait until the rate profile is complete; raises RequestRejected where it is not in time."""
        while True:
            (status,) = self._numbers(acl.register(f"A{self._axis}DYN"), 1)
            if int(status) >> acl.RATE_COMPLETE & 1 and self.is_moving():
                return
            self._demand_time(deadline_s, f"does not reach {rate_dps:g} deg/s")
            self._clock.sleep(POLL_S)

    def _come_to_rest(self) -> None:
        """Change to Off mode and wait until the table stands."""
        self._link.ask(acl.off(self._axis))
        self._rate_dps, self._last = 0.0, None
        deadline_s = self._clock.now_s() + self._tolerated_s(self._ramp_s(self.settings.max_rate_dps))
        while self.is_moving():
            if self._clock.now_s() > deadline_s:
                raise NoReply(self.name, "the table still turns after the command Off; press its stop switch")
            self._clock.sleep(POLL_S)

    def _demand_time(self, deadline_s: float, purpose: str) -> None:
        """Stop the table and say why, after the deadline or once the interlock is not closed any more."""
        cause = self._cause()
        if cause or self._clock.now_s() > deadline_s:
            self.stop()
            raise RequestRejected(self.name, purpose + (cause or "; check load, limits and mode of the controller"))

    def _quickest_answer(self, message: str) -> tuple[str, float, float]:
        """Return the answer that came quickest to a few equal questions, where answers are quick, and its times."""
        answers = [self._link.timed(message)]
        while len(answers) < QUESTIONS and answers[-1][2] - answers[-1][1] < QUICK_S:
            answers.append(self._link.timed(message))
        return min(answers, key=lambda answer: answer[2] - answer[1])

    def _cause(self) -> str:
        return checks.interlock_cause(self.name, self._axis, self._link)

    def _numbers(self, message: str, least: int) -> list[float]:
        return checks.numbers(self.name, self._link.ask(message), least)

    def _ramp_s(self, rate_dps: float) -> float:
        return abs(rate_dps) / self.settings.acceleration_dps2

    @staticmethod
    def _tolerated_s(duration_s: float) -> float:
        return END_TOLERANCE_S + (1 + END_TOLERANCE_SHARE) * duration_s


DRIVER = TableDriver(Acutrol3000Settings, Acutrol3000)
