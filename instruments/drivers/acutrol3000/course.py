"""Courses of the rate on an ACUTROL 3000: a ramp uses the rate mode with its acceleration limit, a sweep the oscillator
of the controller, which changes amplitude and frequency by itself.

Only the fade-out is commanded while a course runs. When the computer fails, the course continues without end: the
controller has no watchdog over its command interface.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from instruments.clock import Clock
from instruments.drivers.acutrol3000 import checks
from instruments.drivers.acutrol3000.link import AcutrolLink
from instruments.errors import LimitError, RequestRejected
from instruments.interfaces.rate_course import Ramp, RateCourse, SineSweep
from instruments.interfaces.table import AngleReading, CourseRun, reply_time_u_s
from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings

#: Interval at which the interlock is read during a course, s.
ASK_EVERY_S = 2.0


class CourseFollower:
    """Commands of courses, and the angles of the encoder during one."""

    def __init__(self, device: str, settings: Acutrol3000Settings, link: AcutrolLink, clock: Clock) -> None:
        self._device, self._settings, self._link, self._clock = device, settings, link, clock
        self._last: AngleReading | None = None
        self._quickest_s = math.inf
        self._ask_s = 0.0  #: time at which the interlock is read next, clock time

    def check(self, course: RateCourse) -> None:
        """Raise LimitError for a sweep whose frequencies the oscillator does not have."""
        if isinstance(course, SineSweep) and min(course.from_hz, course.to_hz) < acl.MIN_HZ:
            raise LimitError(
                self._device,
                f"a sine of {min(course.from_hz, course.to_hz):g} Hz is below the limit of its oscillator, "
                f"{acl.MIN_HZ:g} Hz; raise from_hz and to_hz",
            )

    def begin(self, course: RateCourse) -> CourseRun:
        """Begin a course; the table runs at its initial rate already. Raises RequestRejected, LinkError and others."""
        self._last = None
        axis = self._settings.axis
        if isinstance(course, Ramp):
            command = acl.ramp(axis, self._settings.direction * course.to_dps, course.largest_dps2)
        else:
            decades = abs(math.log10(course.to_hz / course.from_hz)) / course.duration_s
            self._link.ask(acl.configure_oscillator(axis, course.amplitude_dps / course.fade_s, decades))
            self._link.ask(f"{self._sine(0.0, course.from_hz)};{acl.synthesis(axis)}")
            command = self._sine(course.amplitude_dps, course.to_hz)
        _, sent_s, answered_s = self._link.timed(command)
        u_s = math.hypot(self._settings.time_u_s, reply_time_u_s(answered_s - sent_s))
        return CourseRun(course, (sent_s + answered_s) / 2, u_s, is_whole=isinstance(course, Ramp))

    def go_on(self, run: CourseRun) -> CourseRun:
        """Command the fade-out once it is due; raises RequestRejected where an interlock has ended the course."""
        course = run.course
        if self._clock.now_s() >= self._ask_s:
            self.demand_closed(course)
        if run.is_whole or not isinstance(course, SineSweep) or self._clock.now_s() < run.began_s + course.fades_s:
            return run
        _, sent_s, answered_s = self._link.timed(self._sine(0.0, course.to_hz))
        late_s = (sent_s + answered_s) / 2 - run.began_s - course.fades_s
        return replace(run, course=replace(course, late_s=late_s), is_whole=True)

    def demand_closed(self, course: RateCourse) -> None:
        """Raise RequestRejected with the cause where the interlock is open, with which the table stops by itself."""
        self._ask_s = self._clock.now_s() + ASK_EVERY_S
        if cause := checks.interlock_cause(self._device, self._settings.axis, self._link):
            raise RequestRejected(
                self._device, f"stopped during a {course.text}{cause}; check load and limits, then home the table"
            )

    def angle(self, run: CourseRun) -> AngleReading:
        """Read the angle, unwrapped by the commanded rate, and the middle of the time between request and reply."""
        text, sent_s, answered_s = self._link.timed(f":Read:Position? {self._settings.axis}")
        t_s = (sent_s + answered_s) / 2
        angle_deg = self._settings.direction * checks.numbers(self._device, text, 1)[0]
        if self._last is not None:
            since = np.array([self._last.t_s, t_s]) - run.began_s
            expected_deg = self._last.angle_deg + float(np.diff(run.course.angle_deg(since))[0])
            angle_deg += 360.0 * round((expected_deg - angle_deg) / 360.0)
        self._quickest_s = min(self._quickest_s, answered_s - sent_s)
        u_s = math.hypot(self._settings.time_u_s, (answered_s - sent_s - self._quickest_s) / math.sqrt(12))
        self._last = AngleReading(
            t_s, angle_deg, self._settings.encoder_u_deg, u_s, reply_time_u_s(answered_s - sent_s)
        )
        return self._last

    def _sine(self, size_dps: float, frequency_hz: float) -> str:
        phase_deg = 0.0 if self._settings.direction > 0 else 180.0
        return acl.demand_oscillator(self._settings.axis, size_dps, frequency_hz, phase_deg)
