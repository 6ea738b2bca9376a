"""A simulated gyro on a CAN bus, by any DBC file: it packs the bits of its messages itself.

The layout of signals is that of the DBC file format: a start bit is the least significant one of a signal of byte order
1 (Intel), the most significant one of byte order 0 (Motorola).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

from instruments.bench_config import part_of
from instruments.protocols.can.frames import BUS_OFF, ERROR, FRAME_BYTES, CanFrame, packed
from instruments.protocols.can.settings import CanSettings
from instruments.protocols.can.units import unit_of_text
from instruments.protocols.stream_formats.units import UNITS
from instruments.simulators.sampled_unit import SampledUnit
from instruments.simulators.setup import InstrumentSetup

_MESSAGE = re.compile(r"^BO_ (\d+) (\w+) *: *(\d+)")
_SIGNAL = re.compile(
    r"^\s*SG_ (\w+) *(?:M|m\d+M?)? *: *(\d+)\|(\d+)@([01])([+-]) *\(([^,]+),([^)]+)\) *\[[^\]]*\] *\"([^\"]*)\""
)
_FLOAT = re.compile(r"^SIG_VALTYPE_ (\d+) (\w+) *: *([12])")
_TEXTS = re.compile(r"^VAL_ (\d+) (\w+) (.*);")
#: Messages that are held come once in so many seconds, and with the first cycle.
RARE_S = 0.5
#: A message of another node that is on the bus too.
FOREIGN = packed(CanFrame(0x123, b"\x01\x02\x03"))


@dataclass
class PackedSignal:
    """A signal as the DBC file gives it: value = offset + scale * raw."""

    name: str
    start: int
    bits: int
    is_intel: bool
    is_signed: bool
    scale: float
    offset: float
    unit: str
    float_bits: int = 0
    texts: dict[str, int] = field(default_factory=dict)

    def positions(self) -> Iterator[int]:
        """Yield the bits of the message, 8 * byte + bit, from the least significant one of the signal on."""
        if self.is_intel:
            yield from range(self.start, self.start + self.bits)
            return
        at, bits = self.start, []
        for _ in range(self.bits):
            bits.append(at)
            at = at + 15 if at % 8 == 0 else at - 1  # from bit 0 of a byte on to bit 7 of the next
        yield from reversed(bits)

    def code(self, value: float) -> int:
        """Return the bits of a value as a whole number that is not negative."""
        raw = (value - self.offset) / self.scale
        if self.float_bits:
            return int.from_bytes(struct.pack("<f" if self.float_bits == 32 else "<d", raw), "little")
        least, most = (
            (-(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1) if self.is_signed else (0, (1 << self.bits) - 1)
        )
        return min(max(round(raw), least), most) & ((1 << self.bits) - 1)


@dataclass
class PackedMessage:
    """A message: its identifier as the DBC file has it, bytes and signals."""

    id: int
    name: str
    length: int
    signals: dict[str, PackedSignal] = field(default_factory=dict)

    def frame(self, values: dict[str, float]) -> bytes:
        """Return the frame of physical values by signal; the others are 0."""
        bits = 0
        for name, value in values.items():
            signal = self.signals[name]
            code = signal.code(value)
            for place, at in enumerate(signal.positions()):
                bits |= ((code >> place) & 1) << at
        return packed(CanFrame(self.id, bits.to_bytes(self.length, "little")))


def read_messages(dbc: str) -> dict[str, PackedMessage]:
    """Return the messages of a DBC text by name."""
    by_name: dict[str, PackedMessage] = {}
    message = PackedMessage(0, "", 0)
    for line in dbc.splitlines():
        if begins := _MESSAGE.match(line):
            message = PackedMessage(int(begins[1]), begins[2], int(begins[3]))
            by_name[message.name] = message
        elif match := _SIGNAL.match(line):
            name, start, bits, order, sign, scale, offset, unit_symbol = match.groups()
            message.signals[name] = PackedSignal(
                name, int(start), int(bits), order == "1", sign == "-", float(scale), float(offset), unit_symbol
            )
    by_id = {each.id: each for each in by_name.values()}
    for line in dbc.splitlines():
        if (match := _FLOAT.match(line)) and int(match[1]) in by_id:
            by_id[int(match[1])].signals[match[2]].float_bits = 32 * int(match[3])
        elif (match := _TEXTS.match(line)) and int(match[1]) in by_id:
            texts = re.findall(r'(-?\d+) "([^"]*)"', match[3])
            by_id[int(match[1])].signals[match[2]].texts = {text: int(raw) for raw, text in texts}
    return by_name


class SimulatedCanUnit(SampledUnit):
    """Sends the messages of a cycle per sampling interval of the world's unit, the first one first."""

    def __init__(self, setup: InstrumentSetup) -> None:
        settings = part_of(setup.gyro, CanSettings)
        self._settings = settings
        self._messages = read_messages(settings.dbc)
        counters = () if settings.counter is None else settings.counter.signals
        status = {path: _good_value(self._signal(path), texts[0]) for path, texts in settings.status.items()}
        self._status, self._counters = status, counters
        names = {path.partition(".")[0] for path in (*settings.signals.values(), *status, *counters)}
        held = {path.partition(".")[0] for name, path in settings.signals.items() if name in settings.hold}
        cyclic = {path.partition(".")[0] for name, path in settings.signals.items() if name not in settings.hold}
        first = settings.first.partition(".")[0]
        self._cyclic = sorted(
            names & (cyclic | {path.partition(".")[0] for path in counters}), key=lambda each: each != first
        )
        self._rare = sorted((held | names) - set(self._cyclic))
        most = setup.port_buffer_bytes // (FRAME_BYTES * (len(self._cyclic) + 1))
        super().__init__(setup, tuple(settings.axes), most)

    def transmit(self, t_s: float) -> bytes:
        """Return the frames of the cycles up to `t_s`."""
        index = self._due(t_s)
        if not len(index):
            return b""
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            index = index[gap.value :]
        values = self._values(index)
        out = [
            self._cycle(int(each), {name: float(column[n]) for name, column in values.items()})
            for n, each in enumerate(index)
        ]
        if out and self._faults.trigger(["lost_reply"], t_s) is not None:
            out[0] = out[0][:-1]
        if out and self._faults.trigger(["wrong_crc"], t_s) is not None:
            out[0].insert(0, packed(CanFrame(ERROR | 0x88, bytes(8))))  # the sender repeats the message
        if self._faults.trigger(["stall"], t_s) is not None:
            out = [[packed(CanFrame(ERROR | BUS_OFF, bytes(8)))]]
        return b"".join(frame for cycle in out for frame in cycle)

    def _signal(self, path: str) -> PackedSignal:
        message, _, name = path.partition(".")
        return self._messages[message].signals[name]

    def _cycle(self, index: int, values: dict[str, float]) -> list[bytes]:
        """Return the frames of one cycle; those behind the first come in any order."""
        by_message: dict[str, dict[str, float]] = {}
        for name, path in self._settings.signals.items():
            if name in values:
                message, _, signal = path.partition(".")
                by_message.setdefault(message, {})[signal] = self._in_its_unit(name, self._signal(path), values[name])
        for path, value in self._status.items():
            message, _, signal = path.partition(".")
            by_message.setdefault(message, {})[signal] = value
        counter = self._settings.counter
        for path in self._counters:
            message, _, signal = path.partition(".")
            signal_law, step = self._signal(path), 1 if counter is None else counter.step
            wrap = (counter.wrap if counter is not None else None) or 1 << signal_law.bits
            by_message.setdefault(message, {})[signal] = signal_law.offset + signal_law.scale * (index * step % wrap)
        begins, *others = self._cyclic
        order = [begins, *(others[each] for each in self._rng.permutation(len(others)))]
        if index % max(1, round(RARE_S * self._rate_hz)) == 1:
            order = [*self._rare, *order]
        frames = [self._messages[name].frame(by_message.get(name, {})) for name in order]
        return [*frames[:-1], FOREIGN, frames[-1]]

    def _in_its_unit(self, name: str, signal: PackedSignal, value: float) -> float:
        conversion = UNITS[unit_of_text(self._settings.units.get(name, signal.unit)) or ""]
        return (value - conversion.offset) / conversion.factor


def _good_value(signal: PackedSignal, value: int | str) -> float:
    raw = signal.texts[value] if isinstance(value, str) else value
    return signal.offset + signal.scale * raw
