"""Signals of a DBC file, read by cantools (optional extra `can`): where they are in a message, and what they mean."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from instruments.errors import one_line
from instruments.protocols.can.frames import EXTENDED, MAX_DATA
from instruments.toml_documents import listed

if TYPE_CHECKING:
    from cantools.database.can import Database, Message, Signal

#: The text of a DBC file is kept with each campaign.
MAX_CHARACTERS = 1 << 19


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
        if message.length > MAX_DATA:
            raise ValueError(
                f"{path!r}: message {message_name} has {message.length} bytes, but a frame of classical CAN holds at "
                f"most {MAX_DATA}; CAN FD is not read: configure the unit for classical CAN"
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
            signals = self._by_id[frame_id].decode_simple(data, decode_choices=False, scaling=False)
        except DecodeError:
            return None
        return {name: value for name, value in signals.items() if isinstance(value, int | float)}


def frame_id_of(message: Message) -> int:
    """Return the identifier of a message, with the flag of an extended one."""
    return message.frame_id | (EXTENDED if message.is_extended_frame else 0)


def _choice(location: str, quantity: str, wrong: str, choices: list[str]) -> str:
    near = difflib.get_close_matches(wrong, choices, n=1)
    hint = f"did you mean {near[0]!r}? If not, " if near else ""
    return f"{location} has no {quantity} {wrong!r}; {hint}choose one of {listed(choices, 20)}"


def _signal(message: Message, signal: Signal) -> CanSignal:
    choices = {str(text): raw for raw, text in (signal.choices or {}).items()}
    return CanSignal(
        f"{message.name}.{signal.name}", signal.name, frame_id_of(message), signal.length, signal.is_signed,
        signal.is_float, signal.multiplexer_ids is not None, float(signal.scale), float(signal.offset),
        signal.unit or "", choices,
    )  # fmt: skip


@functools.lru_cache(maxsize=8)
def _parsed(text: str) -> Database:
    if len(text) > MAX_CHARACTERS:
        raise ValueError(
            f"the DBC text has {len(text)} characters, the limit is {MAX_CHARACTERS}; keep only the messages of the "
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
        parsed = database.load_string(text, database_format="dbc")
    except (Error, ValueError, KeyError) as error:
        raise ValueError(f"the DBC text cannot be read ({one_line(error)}); correct the file") from None
    if isinstance(parsed, database.can.Database):
        return parsed
    raise ValueError("the DBC text describes no CAN messages; give the DBC file of the unit")
