"""Arrick rate table on a C4 serial controller: finite moves of whole steps, nothing else is confirmed of its wire.

A constant rate is one long move at a speed that was programmed before. The speed's command is not public: it is a
template of the bench file, and without it the driver refuses to turn. The reference rate follows from the step clock's
whole divisor, so it is exact against the controller's own clock, and is never the rate that was asked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import serial

from instruments.bench_config import TableSettings
from instruments.clock import Clock, sleep_until
from instruments.errors import LimitError, LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.table import Spin, TableLimits
from instruments.transport.factory import Ports
from instruments.transport.serial import BROKEN

REPLY_S = 1.0
HOME_S = 120.0
#: How much earlier or later than computed a move may end: beyond it, steps were lost or the clock is another.
END_TOLERANCE_S = 2.0
END_TOLERANCE_SHARE = 0.02
#: Steady time beyond what was asked for, so that a gate on step edges always fits.
SPARE_S = 0.5
POLL_S = 0.2


@dataclass(frozen=True)
class Run:
    """A constant rate as this controller can run it."""

    divisor: int
    step_hz: float
    steps: int  #: signed
    ramp_s: float
    ramp_steps: float
    steady_s: float

    @property
    def duration_s(self) -> float:
        """From start to rest."""
        return self.steady_s + 2 * self.ramp_s


def plan_run(settings: TableSettings, rate_dps: float, steady_s: float) -> Run:
    """Return the move that holds the nearest possible rate for `steady_s` at least; `rate_dps` is not 0."""
    step_deg = 360.0 / settings.steps_per_turn
    divisor = max(round(settings.step_clock_hz * step_deg / abs(rate_dps)), 1)
    step_hz = settings.step_clock_hz / divisor
    acceleration = settings.acceleration_dps2 / step_deg
    ramp_steps = step_hz**2 / (2 * acceleration)
    steps = math.ceil(2 * ramp_steps + step_hz * (steady_s + SPARE_S)) + 1
    steady = (steps - 2 * ramp_steps) / step_hz
    return Run(divisor, step_hz, int(math.copysign(steps, rate_dps)), step_hz / acceleration, ramp_steps, steady)


class ArrickC4:
    """Driver of an Arrick table. The angle is counted in steps since home."""

    def __init__(self, settings: TableSettings, ports: Ports, clock: Clock) -> None:
        self.name = "table"
        self.settings = settings
        self._step_deg = 360.0 / settings.steps_per_turn
        self.limits = TableLimits(settings.max_rate_dps, settings.acceleration_dps2, self._step_deg)
        self._ports, self._clock = ports, clock
        self._port: serial.SerialBase | None = None
        self._divisor: int | None = None
        self._ramp_set = False
        self._steps = 0.0
        self._moving: tuple[Run, float] | None = None  #: the move that runs, and when it began

    def identify(self) -> str:
        """Get what the controller says it is (`!1fp`, a text that begins with C4)."""
        self._fresh()
        self._send("!1fp")
        text = self._line()
        if not text.startswith("C4"):
            raise WrongInstrument(self.name, f"{self.settings.port} answered {text!r}, not a C4; check the port's name")
        return text

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the rate that the nearest whole divisor of the step clock gives, deg/s."""
        if abs(rate_dps) > self.limits.max_rate_dps * (1 + 1e-9):
            raise LimitError(
                self.name,
                f"rate {rate_dps:g} deg/s is beyond the table's {self.limits.max_rate_dps:g} deg/s; "
                "ask for less, or plan with --clip",
            )
        if rate_dps == 0:
            return 0.0
        run = plan_run(self.settings, rate_dps, 1.0)
        return math.copysign(run.step_hz * self._step_deg, rate_dps)

    def home(self) -> None:
        """Control the table to its home switch (`!1h1`, one `o`); the angle is 0 deg there."""
        self._fresh()
        self._send("!1h1")
        self._expect("o", HOME_S, "home")
        self._steps, self._moving = 0.0, None

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Control the table to a constant rate for `steady_s` at least, deg/s; returns when it is steady."""
        achieved = self.achievable_dps(rate_dps)
        if rate_dps == 0:
            now = self._clock.now_s()
            return Spin(0.0, 0.0, now, now + steady_s + SPARE_S, self._steps * self._step_deg, self._step_deg)
        run = plan_run(self.settings, rate_dps, steady_s)
        self._fresh()
        self._program(run)
        steps = run.steps * self.settings.direction
        self._send(f"!1m1{'f' if steps > 0 else 'r'}{abs(steps)}n")
        self._expect("a", REPLY_S, "accept a move")
        began = self._clock.now_s()
        from_deg = (self._steps + math.copysign(run.ramp_steps, run.steps)) * self._step_deg
        self._moving = (run, began)
        steady_from = began + run.ramp_s
        sleep_until(self._clock, steady_from)
        return Spin(rate_dps, achieved, steady_from, steady_from + run.steady_s, from_deg, self._step_deg)

    def _program(self, run: Run) -> None:
        """Set ramp and speed by the bench file's templates; each is written on change only."""
        if self.settings.speed_template is None:
            raise RequestRejected(
                self.name,
                "no constant rate: the C4's speed command is not public; set speed_template of the table in the bench "
                "file from your controller's manual",
            )
        if self.settings.ramp_template and not self._ramp_set:
            acceleration = round(self.settings.acceleration_dps2 / self._step_deg)
            self._send(self.settings.ramp_template.format(acceleration=acceleration))
            self._expect("a", REPLY_S, "accept its ramp")
            self._ramp_set = True
        if self._divisor != run.divisor:
            self._send(self.settings.speed_template.format(divisor=run.divisor))
            self._expect("a", REPLY_S, "accept its speed")
            self._divisor = run.divisor

    def settle(self, spin: Spin) -> None:
        """Control the end of a run: wait for the `o` that confirms every step, at the time it must come."""
        if spin.rate_dps == 0 or self._moving is None:
            return
        run, began = self._moving
        due = began + run.duration_s
        tolerance = END_TOLERANCE_S + END_TOLERANCE_SHARE * run.duration_s
        self._expect("o", due + tolerance - self._clock.now_s(), "finish a move")
        ended = self._clock.now_s()
        self._moving = None
        if ended < due - tolerance:
            raise MalformedReply(
                self.name,
                f"{abs(run.steps)} steps took {ended - began:.1f} s instead of {run.duration_s:.1f} s; "
                "check speed_template, step_clock_hz and acceleration_dps2, or the motor stalls; home the table",
            )
        self._steps += run.steps

    def stop(self) -> None:
        """Control the table to rest (`!1a`); what it has turned is then only computed, until it is homed."""
        if self._moving is None:
            if self._port is not None and self.is_moving():
                self._send("!1a")
                self._byte(REPLY_S)
            return
        run, began = self._moving
        self._moving = None
        self._send("!1a")
        self._byte(REPLY_S)
        deadline = self._clock.now_s() + run.ramp_s + END_TOLERANCE_S
        while self.is_moving():
            if self._clock.now_s() > deadline:
                raise NoReply(self.name, "the table still turns after an abort; switch its power off by hand")
            self._clock.sleep(POLL_S)
        turned = min(max(self._clock.now_s() - began - run.ramp_s, 0.0), run.steady_s) * run.step_hz
        self._steps += math.copysign(turned, run.steps)

    def is_moving(self) -> bool:
        """Get whether the table moves (`!1rs`, `0` when idle)."""
        self._send("!1rs")
        return self._byte(REPLY_S, skip="ao") != "0"

    def angle_deg(self) -> float:
        """Get the commanded angle since home, degrees."""
        if self._moving is None:
            return self._steps * self._step_deg
        run, began = self._moving
        steady = min(max(self._clock.now_s() - began - run.ramp_s, 0.0), run.steady_s)
        return (self._steps + math.copysign(run.ramp_steps + steady * run.step_hz, run.steps)) * self._step_deg

    def close(self) -> None:
        """Control the link: close it."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _open(self) -> serial.SerialBase:
        if self._port is None:
            settings = self.settings
            self._port = self._ports.serial(
                settings.port, device=self.name, baudrate=settings.baudrate, timeout_s=REPLY_S
            )
            self._divisor, self._ramp_set = None, False
        return self._port

    def _fresh(self) -> None:
        """Drop late replies: of a command that was given up, or of an earlier process. Not while a move's `o` waits."""
        if self._moving is not None:
            return
        try:
            self._open().reset_input_buffer()
        except BROKEN as error:
            self._lose(error)

    def _send(self, command: str) -> None:
        try:
            self._open().write((command + self.settings.terminator).encode("ascii"))
        except BROKEN as error:
            self._lose(error)

    def _lose(self, error: Exception) -> None:
        self.close()
        raise LinkError(
            self.name, f"the link {self.settings.port} broke ({error}); check the cable, then try again"
        ) from error

    def _byte(self, timeout_s: float, skip: str = "") -> str:
        """Return the next letter that is neither a line end nor one of `skip`."""
        port = self._open()
        deadline = self._clock.now_s() + timeout_s
        try:
            while True:
                port.timeout = max(deadline - self._clock.now_s(), 0.0) and self._wire_timeout(deadline)
                found = bytes(port.read(1))
                if found and found not in b"\r\n" and found.decode("latin-1") not in skip:
                    return found.decode("latin-1")
                if not found and self._clock.now_s() >= deadline - 1e-9:
                    raise NoReply(
                        self.name,
                        f"{self.settings.port} gave no answer in {timeout_s:.1f} s; check power, cable and baud rate",
                    )
        except BROKEN as error:
            self._lose(error)
            raise

    def _wire_timeout(self, deadline_s: float) -> float:
        remaining = deadline_s - self._clock.now_s()
        return remaining if self.settings.port.startswith("sim://") else self._clock.wall_s(remaining)

    def _expect(self, letter: str, timeout_s: float, what: str) -> None:
        found = self._byte(timeout_s)
        if found != letter:
            raise RequestRejected(
                self.name, f"answered {found!r} where {letter!r} was expected, so it did not {what}; home the table"
            )

    def _line(self) -> str:
        text = self._byte(REPLY_S, skip="ao")  # letters of an earlier move that ended just now
        port = self._open()
        while (found := bytes(port.read(1))) and found not in b"\r\n":
            text += found.decode("latin-1")
        return text
