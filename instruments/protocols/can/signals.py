"""Which signals of which messages make a reading, and how their raw numbers become the channels of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from instruments.protocols.can.database import CanDatabase, CanSignal
from instruments.protocols.can.units import unit_of_text
from instruments.protocols.stream_formats.document import BINARY_STEP
from instruments.protocols.stream_formats.readings import Scale
from instruments.protocols.stream_formats.units import UNITS, unit_of_channel

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
        scales = {name: _scale(name, channel, units.get(name)) for name, channel in channels.items()}
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


def _scale(name: str, signal: CanSignal, unit_text: str | None) -> Scale:
    text = signal.unit if unit_text is None else unit_text
    unit, channel_unit = unit_of_text(text), unit_of_channel(name)
    fitting = [
        each
        for each, unit_scale in UNITS.items()
        if channel_unit in (None, unit_scale.unit) and not unit_scale.is_per_sample
    ]
    if unit is None or unit not in fitting:
        whose = f"signal {signal.path} has the unit {text!r}" if unit_text is None else f"units gives {text!r}"
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
    if unknown := next((value for value in values if isinstance(value, str) and value not in signal.choices), None):
        choices = ", ".join(map(repr, signal.choices)) or "none"
        raise ValueError(
            f"status {signal.path!r}: the DBC file has no value {unknown!r} (it has {choices}); write one of them, or "
            "a "
            "raw number"
        )
    return frozenset(signal.choices[value] if isinstance(value, str) else value for value in values)


def _counter_bits(counting: Sequence[CanSignal]) -> int | None:
    if wrong := next((each.path for each in counting if each.is_float or each.is_signed), None):
        raise ValueError(f"counter {wrong!r} is no unsigned whole number; name the signal that counts the messages")
    bits = {each.bits for each in counting}
    if len(bits) > 1:
        raise ValueError(f"counter: its signals have {sorted(bits)} bits; name signals of one size")
    return bits.pop() if bits else None
