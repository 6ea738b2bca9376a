"""A simulated C4: the confirmed subset of its wire, and a speed and a ramp command of our own invention."""

from __future__ import annotations

import re
from dataclasses import dataclass

from instruments.bench_config import BenchFile
from instruments.simulators.links.faults import Faults
from instruments.simulators.physics.world import World

BITS_PER_BYTE = 10
MOVE = re.compile(r"m1([fr])(\d+)n")
SPEED = re.compile(r"sp1,(\d+)")
RAMP = re.compile(r"ra1,(\d+)")
REFUSAL = "e"
LONGEST = 80


@dataclass
class _Reply:
    due_s: float
    data: bytes


class SimulatedC4:
    """A C4 controller with one motor, on the world's table."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002  not a gyro's
        self._world, self._faults = world, faults
        self._byte_s = BITS_PER_BYTE / bench.table.baudrate
        self._clock_hz = bench.table.step_clock_hz
        self._acceleration_dps2 = bench.table.acceleration_dps2
        self._step_deg = 360.0 / bench.table.steps_per_turn
        self._direction = bench.table.direction
        self._divisor: int | None = None
        self._line = bytearray()
        self._replies: list[_Reply] = []

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; a command is done when its CR arrives."""
        for byte in data:
            if byte == 0x0D:
                command, self._line = self._line.decode("latin-1"), bytearray()
                self._obey(command, t_s)
            elif len(self._line) < LONGEST:
                self._line.append(byte)

    def transmit(self, t_s: float) -> bytes:
        """Return the replies that are due."""
        due = [reply for reply in self._replies if reply.due_s <= t_s]
        self._replies = [reply for reply in self._replies if reply.due_s > t_s]
        return b"".join(reply.data for reply in due)

    def skip(self, t_s: float) -> None:
        """Lose the replies that are due."""
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  what waits is known
        """Return when the next reply is due."""
        return min((reply.due_s for reply in self._replies), default=None)

    def _say(self, text: str, t_s: float) -> float:
        due = t_s + len(text) * self._byte_s
        self._replies.append(_Reply(due, text.encode("ascii")))
        return due

    def _obey(self, command: str, t_s: float) -> None:
        if not command.startswith("!1"):
            return  # another unit's, or noise
        body = command[2:]
        if self._faults.strike(["refusal"], t_s) is not None:
            self._say(REFUSAL, t_s)
        elif body == "fp":
            self._say("C4 simulated\r\n", t_s)
        elif body == "rs":
            self._say("1" if self._world.table.moving(t_s) else "0", t_s)
        elif body == "a":
            self._replies.clear()
            self._world.table.abort(t_s)
            self._say("a", t_s)
        elif body in {"h1", "h12"}:
            self._finish(self._world.table.home(t_s), t_s)
        elif match := SPEED.fullmatch(body):
            self._divisor = max(int(match[1]), 1)
            self._say("a", t_s)
        elif match := RAMP.fullmatch(body):
            self._acceleration_dps2 = max(int(match[1]), 1) * self._step_deg
            self._say("a", t_s)
        elif (match := MOVE.fullmatch(body)) and self._divisor and not self._world.table.moving(t_s):
            self._move(match[1], int(match[2]), t_s)
        else:
            self._say(REFUSAL, t_s)

    def _move(self, way: str, steps: int, t_s: float) -> None:
        assert self._divisor is not None
        begins = self._say("a", t_s)
        signed = (steps if way == "f" else -steps) * self._direction
        step_hz = self._clock_hz / self._divisor
        ends = self._world.table.start(begins, signed, step_hz, self._acceleration_dps2)
        if self._faults.strike(["stall"], t_s) is not None:
            ends = self._world.table.abort(begins + 0.3 * (ends - begins))
        self._finish(ends, t_s)

    def _finish(self, ends_s: float, t_s: float) -> None:
        if self._faults.strike(["lost_reply"], t_s) is None:
            self._replies.append(_Reply(ends_s + self._byte_s, b"o"))
