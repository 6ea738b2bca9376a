"""Devices that behave oddly: what stands between a driver and a simulated instrument, in virtual time."""

from __future__ import annotations

import errno
import random
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from instruments.conformance.stand import Stand, open_stand, place_of
from instruments.simulators.links.device import SimulatedDevice

#: bytes of the device, clock time -> bytes that arrive
Change = Callable[[bytes, float], bytes]
#: request, reply of the device -> bytes that arrive
Answer = Callable[[bytes, bytes], bytes]
#: The longest that any odd device may hold a call up, clock s.
LONGEST_S = 60.0
#: A flood comes in pieces, one each so many clock s.
EVERY_S = 0.1


class Wire:
    """Passes everything on."""

    def __init__(self, device: SimulatedDevice) -> None:
        self.device = device

    def receive(self, data: bytes, t_s: float) -> None:
        self.device.receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        return self.device.transmit(t_s)

    def skip(self, t_s: float) -> None:
        self.device.skip(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return self.device.next_byte_s(t_s)


class Through(Wire):
    """Changes the bytes of the device on their way."""

    def __init__(self, device: SimulatedDevice, change: Change) -> None:
        super().__init__(device)
        self._change = change

    def transmit(self, t_s: float) -> bytes:
        data = self.device.transmit(t_s)
        return self._change(data, t_s)


class Deaf(Wire):
    """Loses what is sent to the device."""

    def receive(self, data: bytes, t_s: float) -> None:
        del data, t_s


class Late(Wire):
    """Delivers every byte `late_s` after it was sent, in pieces of `piece` bytes, `pause_s` apart."""

    def __init__(self, device: SimulatedDevice, late_s: float, piece: int = 1 << 20, pause_s: float = 0.0) -> None:
        super().__init__(device)
        self._late_s, self._piece, self._pause_s = late_s, piece, pause_s
        self._due: list[tuple[float, bytes]] = []

    def transmit(self, t_s: float) -> bytes:
        data = self.device.transmit(t_s)
        for number, at in enumerate(range(0, len(data), self._piece)):
            self._due.append((t_s + self._late_s + number * self._pause_s, data[at : at + self._piece]))
        here = b"".join(each for due_s, each in self._due if due_s <= t_s + 1e-9)
        self._due = [each for each in self._due if each[0] > t_s + 1e-9]
        return here

    def next_byte_s(self, t_s: float) -> float | None:
        found = [due_s for due_s, _ in self._due]
        if (next_s := self.device.next_byte_s(t_s)) is not None:
            found.append(next_s)
        return min(found, default=None)


class Answers(Wire):
    """Answers each request as `answer` says, `late_s` after it."""

    def __init__(self, device: SimulatedDevice, answer: Answer, late_s: float = 0.0) -> None:
        super().__init__(device)
        self._answer, self._late_s = answer, late_s
        self._due: list[tuple[float, bytes]] = []

    def receive(self, data: bytes, t_s: float) -> None:
        self.device.receive(data, t_s)
        if reply := self._answer(data, self.device.transmit(t_s)):
            self._due.append((t_s + self._late_s, reply))

    def transmit(self, t_s: float) -> bytes:
        here = b"".join(each for due_s, each in self._due if due_s <= t_s + 1e-9)
        self._due = [each for each in self._due if each[0] > t_s + 1e-9]
        return here

    def skip(self, t_s: float) -> None:
        self.transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return min((due_s for due_s, _ in self._due), default=None)


class Flood(Wire):
    """Sends bytes all the time, whatever is asked."""

    def __init__(self, device: SimulatedDevice, data: bytes) -> None:
        super().__init__(device)
        self._data, self._since_s = data, 0.0

    def receive(self, data: bytes, t_s: float) -> None:
        del data, t_s

    def transmit(self, t_s: float) -> bytes:
        if t_s - self._since_s < EVERY_S:
            return b""
        self._since_s = t_s
        return self._data

    def skip(self, t_s: float) -> None:
        self._since_s = t_s

    def next_byte_s(self, t_s: float) -> float | None:
        return max(self._since_s + EVERY_S, t_s)


class Unplugged(Wire):
    """Raises an error of the system from a moment on."""

    def __init__(self, device: SimulatedDevice, number: int = errno.EIO, from_s: float = 0.0) -> None:
        super().__init__(device)
        self._number, self._from_s = number, from_s

    def _check(self, t_s: float) -> None:
        if t_s >= self._from_s:
            raise OSError(self._number, "Input/output error" if self._number == errno.EIO else "")

    def receive(self, data: bytes, t_s: float) -> None:
        self._check(t_s)
        super().receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        self._check(t_s)
        return super().transmit(t_s)


def through(change: Change) -> Callable[[SimulatedDevice], Wire]:
    return lambda device: Through(device, change)


def answers(answer: Answer, late_s: float = 0.0) -> Callable[[SimulatedDevice], Wire]:
    return lambda device: Answers(device, answer, late_s)


def noise(seed: int = 1) -> Change:
    """Return random bytes in place of every byte."""
    dice = random.Random(seed)
    return lambda data, _: dice.randbytes(len(data))


def half(data: bytes, t_s: float) -> bytes:
    """Lose the second half of everything that comes at once."""
    del t_s
    return data[: len(data) // 2]


def another_baud_rate(data: bytes, t_s: float) -> bytes:
    """Return what a receiver at twice the bit rate makes of bytes: each bit twice."""
    del t_s
    doubled = b"".join(int("".join(2 * bit for bit in f"{byte:08b}"), 2).to_bytes(2, "big") for byte in data)
    return bytes(byte | 0x80 for byte in doubled)


@dataclass(frozen=True)
class Behaviour:
    """One odd behaviour of one driver's device, and what the driver must make of it.

    `says`: the error's kind and, as a regular expression, its text: what is wrong, where, and what to do. Else `gives`:
    a check of what the driver returns.
    """

    driver: str
    what: str
    wire: Callable[[SimulatedDevice], Any] | None = None
    says: tuple[type[Exception], str] | None = None
    gives: Callable[[Any], bool] | None = None
    faults: Callable[[Any], Any] | None = None  #: armed instead of a wire
    changes: Callable[[Any], Any] | None = None  #: of the bench file, as a record

    def __str__(self) -> str:
        return f"{self.driver}: {self.what}"


def stand_of(behaviour: Behaviour) -> Stand:
    """Return a driver on its bench, changed as a behaviour says."""
    from instruments.bench_config import BenchFile
    from instruments.drivers.resolution import resolve

    file = place_of(behaviour.driver)
    if behaviour.changes is not None:
        record = file.model_dump()
        behaviour.changes(record)
        file = resolve(BenchFile.model_validate(record))
    return open_stand(behaviour.driver, file)


def make_odd(stand: Stand, behaviour: Behaviour) -> None:
    """Put the wire of a behaviour between a driver and its instrument, or arm its faults."""
    simulation: Any = stand.bench.simulation
    if behaviour.wire is not None:
        simulation._devices[stand.url] = behaviour.wire(simulation.device(stand.url))
        if stand.driver.__class__.__name__ != "ArrickC4":
            stand.close()
    if behaviour.faults is not None:
        behaviour.faults(stand.faults)
