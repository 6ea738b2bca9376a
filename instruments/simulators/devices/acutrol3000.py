"""A simulated ACUTROL 3000 with one axis, on the world's servo table.

Numbers of errors are its own: they are not published. The commands are those of TM-8004-C, in long and short form.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.messages import Command, ParseError, commands_of
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings
from instruments.simulators.links.replies import TimedReplies
from instruments.simulators.physics.oscillator import Sine
from instruments.simulators.physics.servo_motion import ServoMotion
from instruments.simulators.physics.world import number
from instruments.simulators.setup import InstrumentSetup

IDENTITY = "Acutronic R&D USA,Acutrol3000,0,A8800-001-01.000-a"
PARSING, OUT_OF_RANGE, NOT_SERVOED = 100, 101, 102
TEXTS = {PARSING: "Command Parse Error", OUT_OF_RANGE: "Parameter Out Of Range", NOT_SERVOED: "Axis Not Servoed"}
STATES = {acl.CLOSED: "Close", acl.OPEN: "Open", acl.FAULT: "Fault"}
MODE_NAMES = {acl.OFF: "Off", acl.RATE: "Rate", acl.POSITION: "Position", acl.SYNTHESIS: "Synthesis"}
#: Noise of the estimated rate at rest, deg/s.
RATE_NOISE_DPS = 1e-4


class Refused(Exception):
    """A command that is not executed; the argument is the number of its error."""


@dataclass
class _Axis:
    """What is set of the axis."""

    mode: str = acl.OFF
    interlock: str = acl.OPEN
    closing_until_s: float = 0.0
    rate_dps: float = 0.0
    position_deg: float = 0.0
    rate_limits: dict[str, float] = field(default_factory=dict)
    acceleration_limits: dict[str, float] = field(default_factory=dict)
    done_s: float = 0.0  #: when the profile is complete
    oscillator: tuple[float, float, float] = (0.0, 1.0, 0.0)  #: demanded size, deg/s, frequency, Hz, and phase, deg
    slews: tuple[float, float] | None = None  #: of size, deg/s^2, and frequency, decades/s; none: it is not configured
    hardware: int = 0  #: bits of its hardware interlocks
    software: int = 0


class SimulatedAcutrol3000(TimedReplies):
    """One controller; `[simulation] table` sets its rate error, its encoder's noise, latency and way of replying."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__()
        table = part_of(setup.instrument("table"), Acutrol3000Settings)
        self._world, self._faults = setup.world, setup.faults
        table_section = setup.world.settings.table
        self.motion = setup.world.servo = setup.world.servo or ServoMotion()
        self._number, self._sign = table.axis, table.direction
        self._absolute = (number(table_section, "absolute_dps", 1000.0), number(table_section, "absolute_dps2", 4200.0))
        #: True rate over the demanded one, forwards and backwards.
        self.ratio = (
            number(table_section, "rate_ratio", 1.0),
            number(table_section, "rate_ratio_reverse", number(table_section, "rate_ratio", 1)),
        )
        self._noise_deg = number(table_section, "encoder_noise_deg", 0.0)
        self._reply_s, self._jitter_s = (
            number(table_section, "reply_s", 0.002),
            number(table_section, "reply_jitter_s", 0.0),
        )
        self._lines = bool(table_section.get("plain_lines", False))
        self._rng = np.random.default_rng([setup.world.settings.seed, setup.world.settings.noise_seed, 3000])
        self.axis = _Axis()
        self._line = bytearray()
        self._errors: list[str] = []
        self._handlers: dict[str, Callable[[Command, float], str]] = {
            "*idn?": lambda _command, _t_s: IDENTITY,
            "*stb?": lambda _command, _t_s: str(int(self.axis.interlock == acl.FAULT) * 65),
            "demand:rate": self._demand_rate, "demand:rate?": lambda *_: acl.number(self.axis.rate_dps),
            "demand:position": self._demand_position,
            "demand:position?": lambda *_: acl.number(self.axis.position_deg),
            "mode:rate": self._mode_rate, "mode:position": self._mode_position, "mode:off": self._mode_off,
            "configure:oscillator": self._configure_oscillator, "demand:oscillator": self._demand_oscillator,
            "mode:synthesis": self._mode_synthesis,
            "mode?": lambda *_: MODE_NAMES[self.axis.mode],
            "interlock?": self._interlock, "interlock:close": self._close, "interlock:open": self._open,
            "interlock:reset": self._reset, "limit:absolute?": self._absolute_limits,
            "limit:rate": self._limit, "limit:rate?": self._limit_found,
            "limit:acceleration": self._limit, "limit:acceleration?": self._limit_found,
            "read:position?": self._position, "read:rate?": self._rate,
            "status:csr?": self._register, "status:msg?": lambda *_: self._errors.pop(0) if self._errors else "",
        }  # fmt: skip

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; a message is executed when its line ends."""
        for byte in data:
            if byte not in acl.LINE_END:
                self._line.append(byte)
            elif self._line:
                message, self._line = self._line.decode("latin-1"), bytearray()
                self._reply(*self._execute(message, t_s), t_s)

    def trip(self, t_s: float, *, hardware: int = 0, software: int = 0) -> None:
        """Break the interlock: the axis is shut down, and the status is frozen."""
        self.axis.interlock, self.axis.mode = acl.FAULT, acl.OFF
        self.axis.hardware, self.axis.software = hardware, software
        self._run(0.0, t_s)

    def _reply(self, error: int, text: str, t_s: float) -> None:
        if self._faults.trigger(["lost_reply"], t_s) is not None:
            return
        due_s = t_s + self._reply_s + self._jitter_s * float(self._rng.exponential())
        self.send_at(due_s, text.encode() + acl.LINE_END if self._lines else acl.packed(error, text))

    def _execute(self, message: str, t_s: float) -> tuple[int, str]:
        """Execute a message; returns the error of the first command that was refused, or the replies to its queries."""
        replies = []
        try:
            for command in commands_of(message):
                if self._faults.trigger(["refusal"], t_s) is not None:
                    raise Refused(OUT_OF_RANGE)
                replies.append(self._one(command, t_s))
        except (ParseError, Refused) as error:
            code = error.args[0] if isinstance(error, Refused) else PARSING
            self._errors.append(f"{code}:{TEXTS[code]}")
            return code, TEXTS[code]
        return 0, ";".join(text for text in replies if text) or acl.DONE

    def _one(self, command: Command, t_s: float) -> str:
        if self.axis.closing_until_s and t_s >= self.axis.closing_until_s:
            self.axis.interlock, self.axis.closing_until_s = acl.CLOSED, 0.0
        if self._faults.trigger(["stall"], t_s) is not None:
            self.trip(t_s, software=1 << 2)
        handler = self._handlers.get(command.path)
        if handler is None:
            raise Refused(PARSING)
        return handler(command, t_s)

    def _of_axis(self, command: Command, at: int = 0) -> None:
        if len(command.arguments) <= at or command.arguments[at] != str(self._number):
            raise Refused(OUT_OF_RANGE)

    def _demand_rate(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        self.axis.rate_dps = command.value(1)
        return self._mode_rate(command, t_s) if self.axis.mode == acl.RATE else ""

    def _demand_position(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        self.axis.position_deg = command.value(1)
        return self._mode_position(command, t_s) if self.axis.mode == acl.POSITION else ""

    def _mode_rate(self, command: Command, t_s: float) -> str:
        self._servo(command, acl.RATE)
        limit = self.axis.rate_limits.get(acl.RATE, self._absolute[0])
        self._run(max(min(self.axis.rate_dps, limit), -limit), t_s)
        return ""

    def _mode_position(self, command: Command, t_s: float) -> str:
        self._servo(command, acl.POSITION)
        rate = self.axis.rate_limits.get(acl.POSITION, self._absolute[0])
        self.axis.done_s = self.motion.move_to(
            t_s, self._sign * self.axis.position_deg, rate, self._acceleration(acl.POSITION)
        )
        return ""

    def _configure_oscillator(self, command: Command, t_s: float) -> str:  # noqa: ARG002  for the next demand
        self._of_axis(command)
        if [word[:1].lower() for word in (*command.arguments[1:2], *command.arguments[4:6])] != ["e", "r", "l"]:
            raise Refused(OUT_OF_RANGE)  # it has other modes, which labctl does not use
        self.axis.slews = command.value(2), command.value(3)
        return ""

    def _demand_oscillator(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        size, frequency, phase = (command.value(at) for at in (1, 2, 3))
        limits = (self.axis.rate_limits, self._absolute[0]), (self.axis.acceleration_limits, self._absolute[1])
        rate, acceleration = (limit.get(acl.SYNTHESIS, most) for limit, most in limits)
        if not 0 <= size <= rate or frequency <= 0 or 2 * np.pi * frequency * size > acceleration * (1 + 1e-6):
            raise Refused(OUT_OF_RANGE)
        self.axis.oscillator = size, frequency, phase
        sine = self.motion.sine()
        if self.axis.mode == acl.SYNTHESIS and sine is not None and self.axis.slews is not None:
            self.motion.oscillate(sine.changed(t_s, self.ratio[0] * size, frequency, *self.axis.slews))
        return ""

    def _mode_synthesis(self, command: Command, t_s: float) -> str:
        if self.axis.slews is None:
            raise Refused(OUT_OF_RANGE)
        self._servo(command, acl.SYNTHESIS)
        size, frequency, phase = self.axis.oscillator
        phase_rad = np.radians(phase + (0.0 if self._sign > 0 else 180.0))
        whole = self.ratio[0] * size
        self.motion.oscillate(Sine(t_s, float(phase_rad), 0.0, frequency, whole, frequency, *self.axis.slews))
        return ""

    def _mode_off(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        self.axis.mode = acl.OFF
        self._run(0.0, t_s)
        return ""

    def _servo(self, command: Command, mode: str) -> None:
        """Change the mode of an axis that is servoed."""
        self._of_axis(command)
        if self.axis.interlock != acl.CLOSED:
            raise Refused(NOT_SERVOED)
        self.axis.mode = mode

    def _run(self, rate_dps: float, t_s: float) -> None:
        true_dps = self._sign * rate_dps * self.ratio[rate_dps < 0]
        self.axis.done_s = self.motion.set_rate(t_s, true_dps, self._acceleration(self.axis.mode))

    def _acceleration(self, mode: str) -> float:
        return self.axis.acceleration_limits.get(mode, self._absolute[1])

    def _interlock(self, command: Command, t_s: float) -> str:  # noqa: ARG002  its state is as of now
        self._of_axis(command)
        return STATES[self.axis.interlock]

    def _close(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        if self.axis.interlock == acl.OPEN:
            self.axis.closing_until_s = t_s + 1.0
        return ""

    def _open(self, command: Command, t_s: float) -> str:
        self._mode_off(command, t_s)
        self.axis.interlock, self.axis.closing_until_s = acl.OPEN, 0.0
        return ""

    def _reset(self, command: Command, t_s: float) -> str:  # noqa: ARG002  all axes, at once
        if self.axis.interlock == acl.FAULT:
            self.axis.interlock, self.axis.hardware, self.axis.software = acl.OPEN, 0, 0
        return ""

    def _absolute_limits(self, command: Command, t_s: float) -> str:  # noqa: ARG002  they never change
        self._of_axis(command)
        rate, acceleration = map(acl.number, self._absolute)
        return f"{rate},{acceleration},100000.00000,-360.00000,360.00000,{rate}"

    def _limits_of(self, command: Command) -> tuple[dict[str, float], str]:
        self._of_axis(command, 1)
        limits = self.axis.rate_limits if command.path.startswith("limit:rate") else self.axis.acceleration_limits
        return limits, command.arguments[0][:1].upper()

    def _limit(self, command: Command, t_s: float) -> str:  # noqa: ARG002  it holds from the next motion on
        limits, mode = self._limits_of(command)
        most = self._absolute[limits is self.axis.acceleration_limits]
        if not 0 < command.value(2) <= most:
            raise Refused(OUT_OF_RANGE)
        limits[mode] = command.value(2)
        return ""

    def _limit_found(self, command: Command, t_s: float) -> str:  # noqa: ARG002  as above
        limits, mode = self._limits_of(command)
        return acl.number(limits.get(mode, self._absolute[limits is self.axis.acceleration_limits]))

    def _position(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        angle = self._sign * float(self.motion.angle_deg(np.array([t_s]))[0])
        return acl.number((angle + self._noise_deg * self._rng.standard_normal()) % 360.0)

    def _rate(self, command: Command, t_s: float) -> str:
        self._of_axis(command)
        return acl.number(self._sign * self.motion.rate_dps(t_s) + RATE_NOISE_DPS * self._rng.standard_normal())

    def _register(self, command: Command, t_s: float) -> str:
        match = re.fullmatch(rf"a{self._number}(dyn|intlk|swflt|state)", command.arguments[0].lower())
        if match is None:
            raise Refused(OUT_OF_RANGE)
        done = t_s >= self.axis.done_s
        values = {
            "dyn": done << (acl.POSITION_COMPLETE if self.axis.mode == acl.POSITION else acl.RATE_COMPLETE),
            "intlk": self.axis.hardware, "swflt": self.axis.software, "state": (self.axis.interlock == acl.CLOSED) << 4,
        }  # fmt: skip
        return str(values[match[1]])
