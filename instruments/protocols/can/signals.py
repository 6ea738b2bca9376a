"""Which signals of which messages make a reading, and how their raw numbers become the channels of a recording."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from instruments.errors import one_line
from instruments.protocols.can.frames import EXTENDED, MOST_DATA
from instruments.protocols.can.units import unit_of_text
from instruments.protocols.stream_formats.document import BINARY_STEP
from instruments.protocols.stream_formats.readings import Scale
from instruments.protocols.stream_formats.units import UNITS, unit_of_channel
from instruments.toml_documents import listed

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal


#: The text of a DBC file is kept with each campaign.
MOST_CHARACTERS = 1 << 19


@dataclass(frozen=True)
class CanSignal:
    """One signal: value in `unit` = offset + scale * raw number."""

    path: str  #: Message.Signal
    name: str
    frame_id: int  #: of its message, with the flag of an extended one
    bits: int
    is_signed: bool
    is_float: bool
    is_multiplexed: bool
    scale: float
    offset: float
    unit: str
    choices: Mapping[str, int]  #: text of a raw value -> raw value

    @property
    def code_range(self) -> tuple[int, int]:
        """Least and greatest raw number of a signal that is no floating-point number."""
        if self.is_signed:
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, (1 << self.bits) - 1


class CanDatabase:
    """The messages of a DBC text. Raises ValueError, also where cantools is not installed."""

    def __init__(self, text: str) -> None:
        self._messages = {message.name: message for message in _parsed(text).messages}
        self._by_id = {frame_id_of(message): message for message in self._messages.values()}

    def signal(self, path: str) -> CanSignal:
        """Return the signal of a path Message.Signal; raises ValueError naming those that there are."""
        message_name, _, name = path.partition(".")
        message = self._messages.get(message_name)
        if message is None:
            raise ValueError(f"{path!r}: {_choice('the DBC file', 'message', message_name, list(self._messages))}")
        signals = {each.name: each for each in message.signals}
        if name not in signals:
            raise ValueError(f"{path!r}: {_choice(f'message {message_name}', 'signal', name, list(signals))}")
        if message.length > MOST_DATA:
            raise ValueError(
                f"{path!r}: message {message_name} has {message.length} bytes, but a frame of classical CAN holds at "
                f"most {MOST_DATA}; CAN FD is not read: configure the unit for classical CAN"
            )
        return _signal(message, signals[name])

    def message_name(self, frame_id: int) -> str:
        """Return the name of the message of an identifier, and the identifier in hexadecimal digits."""
        return f"{self._by_id[frame_id].name} (0x{frame_id & ~EXTENDED:X})"

    def is_multiplexed(self, frame_id: int) -> bool:
        """Return whether the signals of a message depend on a multiplexer in it."""
        return self._by_id[frame_id].is_multiplexed()

    def raw(self, frame_id: int, data: bytes) -> dict[str, int | float] | None:
        """Return the raw numbers of a message's signals by name; None for data that do not fit the message."""
        from cantools.database import DecodeError

        try:
            found = self._by_id[frame_id].decode_simple(data, decode_choices=False, scaling=False)
        except DecodeError:
            return None
        return {name: value for name, value in found.items() if isinstance(value, int | float)}


def frame_id_of(message: Message) -> int:
    """Return the identifier of a message, with the flag of an extended one."""
    return message.frame_id | (EXTENDED if message.is_extended_frame else 0)


def _choice(where: str, what: str, wrong: str, known: list[str]) -> str:
    near = difflib.get_close_matches(wrong, known, n=1)
    hint = f"did you mean {near[0]!r}? If not, " if near else ""
    return f"{where} has no {what} {wrong!r}; {hint}choose one of {listed(known, 20)}"


def _signal(message: Message, signal: Signal) -> CanSignal:
    choices = {str(text): raw for raw, text in (signal.choices or {}).items()}
    return CanSignal(
        f"{message.name}.{signal.name}", signal.name, frame_id_of(message), signal.length, signal.is_signed,
        signal.is_float, signal.multiplexer_ids is not None, float(signal.scale), float(signal.offset),
        signal.unit or "", choices,
    )  # fmt: skip


@functools.lru_cache(maxsize=8)
def _parsed(text: str) -> Database:
    if len(text) > MOST_CHARACTERS:
        raise ValueError(
            f"the DBC text has {len(text)} characters, the limit is {MOST_CHARACTERS}; keep only the messages of the "
            "unit in the file"
        )
    try:
        from cantools import database
        from cantools.database.errors import Error
    except ImportError:
        raise ValueError(
            "a DBC file is read by cantools, which is not installed; run `pip install labctl[can]`"
        ) from None
    try:
        found = database.load_string(text, database_format="dbc")
    except (Error, ValueError, KeyError) as error:
        raise ValueError(f"the DBC text cannot be read ({one_line(error)}); correct the file") from None
    if isinstance(found, database.can.Database):
        return found
    raise ValueError("the DBC text describes no CAN messages; give the DBC file of the unit")


#: Name of the counter beside the channels; no channel has capital letters.
COUNTER = "COUNTER"


@dataclass(frozen=True)
class CanLayout:
    """Signals of a reading by name: a channel, a status signal by its path, and COUNTER."""

    database: CanDatabase
    parts: Mapping[int, Sequence[tuple[str, CanSignal]]]  #: message -> names and signals that are read from it
    scales: Mapping[str, Scale]  #: channel -> what its whole numbers mean, in the order of the bench file
    held: frozenset[str]  #: whose last value stands for the cycles between: `hold`, and status signals that come alone
    good: Mapping[str, frozenset[int]]  #: status signal -> its values in a valid reading
    counter_bits: int | None  #: None: no signal counts
    is_counted_apart: bool  #: whether every message of a cycle has the counter
    first: int | None  #: message with which a cycle begins; None: a cycle is one message, or is known by its counter
    first_name: str = ""  #: the name in that message, where the message is multiplexed

    @classmethod
    def of(
        cls, dbc: str, signals: Mapping[str, str], *, axes: Sequence[str], units: Mapping[str, str],
        hold: Sequence[str], status: Mapping[str, Sequence[int | str]], counters: Sequence[str], first: str,
    ) -> CanLayout:  # fmt: skip
        """Return the layout that a bench file describes; raises ValueError naming the key and what to write."""
        database = CanDatabase(dbc)
        _require_channels(signals, axes, units, hold)
        channels = {name: database.signal(path) for name, path in signals.items()}
        scales = {name: _scale(name, each, units.get(name)) for name, each in channels.items()}
        checked = {path: database.signal(path) for path in status}
        counting = [database.signal(path) for path in counters]
        parts: dict[int, list[tuple[str, CanSignal]]] = {}
        for name, signal in [*channels.items(), *checked.items(), *((COUNTER, each) for each in counting)]:
            parts.setdefault(signal.frame_id, []).append((name, signal))
        held = frozenset(hold) | _rare(parts, hold)
        needed = {key: [each for each in part if each[0] not in held] for key, part in parts.items()}
        needed = {key: part for key, part in needed.items() if part}
        is_apart = bool(counting) and all(COUNTER in [name for name, _ in part] for part in needed.values())
        is_split = len(needed) > 1 or any(each.is_multiplexed for part in needed.values() for _, each in part)
        begins = database.signal(first) if first else None
        if begins is None and is_split and not is_apart:
            raise ValueError(
                f"a reading is made of several messages ({', '.join(map(database.message_name, needed))}); name a "
                "signal of the one with which each cycle begins by `first`, or give `counter` a signal of each message"
            )
        if begins is not None and begins.frame_id not in needed:
            raise ValueError(
                f"first = {first!r}: its message holds no channel that comes in every cycle; name a signal of "
                f"{' or '.join(map(database.message_name, needed))}"
            )
        return cls(
            database, parts, scales, held,
            {path: _good(signal, status[path]) for path, signal in checked.items()},
            _counter_bits(counting), is_apart, begins.frame_id if begins is not None and is_split else None,
            "" if begins is None else begins.name,
        )  # fmt: skip


def _rare(parts: Mapping[int, Sequence[tuple[str, CanSignal]]], hold: Sequence[str]) -> frozenset[str]:
    """Return the status signals that are alone in a message, or with channels that are held."""
    alone = [part for part in parts.values() if not any(_is_of_cycle(name, hold) for name, _ in part)]
    return frozenset(name for part in alone for name, _ in part)


def _is_of_cycle(name: str, hold: Sequence[str]) -> bool:
    return name == COUNTER or ("." not in name and name not in hold)


def _require_channels(
    signals: Mapping[str, str], axes: Sequence[str], units: Mapping[str, str], hold: Sequence[str]
) -> None:
    rates = {f"gyro_{axis}" for axis in axes}
    if missing := sorted(rates - set(signals)):
        raise ValueError(
            f"axes = {list(axes)}, but signals has no {missing[0]}; add {missing[0]} = 'Message.Signal', or correct "
            "axes"
        )
    for key, names in (("units", units), ("hold", hold)):
        if unknown := next((name for name in names if name not in signals), None):
            raise ValueError(f"{key} names {unknown!r}, but signals has no such channel; correct {key} or signals")
    if held := sorted(rates & set(hold)):
        raise ValueError(f"hold names {held[0]}, but a rate must come in every cycle; leave it out of hold")


def _scale(name: str, signal: CanSignal, stated: str | None) -> Scale:
    text = signal.unit if stated is None else stated
    unit, wanted = unit_of_text(text), unit_of_channel(name)
    fitting = [each for each, found in UNITS.items() if wanted in (None, found.unit) and not found.is_per_sample]
    if unit is None or unit not in fitting:
        whose = f"signal {signal.path} has the unit {text!r}" if stated is None else f"units gives {text!r}"
        raise ValueError(
            f"channel {name}: {whose}, which is no unit of this quantity; state the unit of the signal in the bench "
            f"file, units = {{ {name} = {fitting[0]!r} }}, by one of {', '.join(map(repr, fitting))}"
        )
    conversion, step = UNITS[unit], BINARY_STEP if signal.is_float else 1.0
    scale = step * signal.scale * conversion.factor
    return Scale(conversion.unit, scale, conversion.offset + signal.offset * conversion.factor)


def _good(signal: CanSignal, values: Sequence[int | str]) -> frozenset[int]:
    if signal.is_float:
        raise ValueError(f"status {signal.path!r} is a floating-point number; name a signal of whole numbers")
    if unknown := next((each for each in values if isinstance(each, str) and each not in signal.choices), None):
        known = ", ".join(map(repr, signal.choices)) or "none"
        raise ValueError(
            f"status {signal.path!r}: the DBC file has no value {unknown!r} (it has {known}); write one of them, or a "
            "raw number"
        )
    return frozenset(signal.choices[each] if isinstance(each, str) else each for each in values)


def _counter_bits(counting: Sequence[CanSignal]) -> int | None:
    if wrong := next((each.path for each in counting if each.is_float or each.is_signed), None):
        raise ValueError(f"counter {wrong!r} is no unsigned whole number; name the signal that counts the messages")
    bits = {each.bits for each in counting}
    if len(bits) > 1:
        raise ValueError(f"counter: its signals have {sorted(bits)} bits; name signals of one size")
    return bits.pop() if bits else None
