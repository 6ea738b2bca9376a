"""A simulated Arrick C4: the public commands, and speed and ramp commands that only this simulator knows."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from instruments.bench_config import part_of
from instruments.protocols import arrick_c4_lines as lines
from instruments.protocols.arrick_c4_settings import ArrickC4Settings
from instruments.simulators.links.replies import TimedReplies
from instruments.simulators.physics.world import number
from instruments.simulators.setup import InstrumentSetup

BITS_PER_BYTE = 10
SPEED = re.compile(r"sp1,(\d+)")
RAMP = re.compile(r"ra1,(\d+)")
IDENTITY = "C4 simulated\r\n"
REFUSED, BUSY = "e", "1"
MAX_COMMAND_BYTES = 80
LINE_ENDS = b"\r\n"
ACKNOWLEDGED = "a\r\n"


class SimulatedC4(TimedReplies):
    """A C4 controller with one motor, on the world's table."""

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__()
        table = part_of(setup.instrument("table"), ArrickC4Settings)
        self._world, self._faults = setup.world, setup.faults
        self._byte_s = BITS_PER_BYTE / table.baudrate
        self._clock_hz = table.step_clock_hz
        self._acceleration_dps2 = table.acceleration_dps2
        self._step_deg = 360.0 / table.steps_per_turn
        self._direction = table.direction
        self._divisor: int | None = None
        #: True step rate over that of the divisor: `[simulation] table = { step_clock_ratio = ... }`.
        self.clock_ratio = number(setup.world.settings.table, "step_clock_ratio", 1.0)
        #: By how much that changes, ppm/h; period of the timer at which the USB adapter passes received bytes on, s.
        self.clock_drift_ppm_per_h = number(setup.world.settings.table, "step_clock_drift_ppm_per_h", 0.0)
        self.latency_s = number(setup.world.settings.table, "reply_latency_s", 0.0)
        self.passed_on_s: Callable[[float], float] = self._at_tick_s  #: when bytes that were sent reach the computer
        self.missed_steps = 0  #: the next move is so much shorter than what was asked for
        self._line = bytearray()

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; a command is executed when its CR or LF arrives."""
        for byte in data:
            if byte in LINE_ENDS:
                command, self._line = self._line.decode("latin-1"), bytearray()
                self._execute(command, t_s)
            elif len(self._line) < MAX_COMMAND_BYTES:
                self._line.append(byte)

    def _reply(self, text: str, t_s: float) -> float:
        """Queue a reply; returns when its last byte is sent."""
        due_s = t_s + len(text) * self._byte_s
        self.send_at(self.passed_on_s(due_s), text.encode("ascii"))
        return due_s

    def _at_tick_s(self, due_s: float) -> float:
        return math.ceil(due_s / self.latency_s) * self.latency_s if self.latency_s else due_s

    def _execute(self, command: str, t_s: float) -> None:
        if not command.startswith(lines.PREFIX):
            return  # to another controller, or noise
        body = command[len(lines.PREFIX) :]
        if self._faults.trigger(["refusal"], t_s) is not None:
            self._reply(REFUSED, t_s)
        elif body == lines.IDENTIFY:
            self._reply(IDENTITY, t_s)
        elif body == lines.STATE:
            self._reply(BUSY if self._world.table.moving(t_s) else lines.IDLE, t_s)
        elif body == lines.ABORT:
            self.forget_replies()
            self._world.table.abort(t_s)
            self._reply(lines.ACCEPTED, t_s)
        elif body in {lines.HOME, lines.HOME_BOTH}:
            end_s = self._world.table.home(t_s)
            for _motor in body.removeprefix("h"):
                self._finish(end_s, t_s)
        elif lines.PARAMETER.fullmatch(body):
            self._reply(ACKNOWLEDGED, t_s)
        else:
            self._program_or_move(body, t_s)

    def _program_or_move(self, body: str, t_s: float) -> None:
        if match := SPEED.fullmatch(body):
            self._divisor = max(int(match[1]), 1)
            self._reply(lines.ACCEPTED, t_s)
        elif match := RAMP.fullmatch(body):
            self._acceleration_dps2 = max(int(match[1]), 1) * self._step_deg
            self._reply(lines.ACCEPTED, t_s)
        elif (match := lines.MOVE.fullmatch(body)) and self._divisor and not self._world.table.moving(t_s):
            self._move(match[1], int(match[2]), self._divisor, t_s)
        else:
            self._reply(REFUSED, t_s)

    def _move(self, way: str, steps: int, divisor: int, t_s: float) -> None:
        start_s = self._reply(lines.ACCEPTED, t_s)
        signed = (steps if way == "f" else -steps) * self._direction
        ratio = self.clock_ratio + 1e-6 * self.clock_drift_ppm_per_h * start_s / 3600.0
        step_hz = ratio * self._clock_hz / divisor
        signed -= int(math.copysign(min(self.missed_steps, steps), signed))
        self.missed_steps = 0
        end_s = self._world.table.start(start_s, signed, step_hz, self._acceleration_dps2)
        if self._faults.trigger(["stall"], t_s) is not None:
            end_s = self._world.table.abort(start_s + 0.3 * (end_s - start_s))
        self._finish(end_s, t_s)

    def _finish(self, end_s: float, t_s: float) -> None:
        if self._faults.trigger(["lost_reply"], t_s) is None:
            self.send_at(self.passed_on_s(end_s + self._byte_s), lines.FINISHED.encode("ascii"))
