"""The wire format of protocol buffers, as far as the calls of NI-DAQmx need it.

A message is a sequence of fields. A field begins with its key, (number << 3) | type, as a varint. An integer is a
varint of 7 bits per byte, the lowest first, negative ones in 64 bits of two's complement; a double has 8 bytes, the
lowest first; texts, messages and packed arrays begin with their length. A value of zero is left out.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

VARINT, DOUBLE, BYTES = 0, 1, 2
LONGEST_VARINT = 10


class Fields:
    """The fields of a message by number; the last of several of one number counts. Raises ValueError for no message."""

    def __init__(self, message: bytes) -> None:
        self._integers: dict[int, int] = {}
        self._bytes: dict[int, bytes] = {}
        at = 0
        while at < len(message):
            key, at = _varint(message, at)
            number, kind = key >> 3, key & 7
            if kind == VARINT:
                self._integers[number], at = _varint(message, at)
                continue
            if kind not in (DOUBLE, BYTES):
                raise ValueError(f"field {number} has the type {kind}, expected 0, 1 or 2")
            length, at = (8, at) if kind == DOUBLE else _varint(message, at)
            if at + length > len(message):
                raise ValueError(f"field {number} has {len(message) - at} bytes, expected {length}")
            self._bytes[number], at = message[at : at + length], at + length

    def integer(self, number: int) -> int:
        """Return a signed integer; 0 where it was left out."""
        value = self._integers.get(number, 0)
        return value - (1 << 64) if value >> 63 else value

    def double(self, number: int) -> float:
        """Return a double; 0 where it was left out."""
        content = self._bytes.get(number)
        return 0.0 if content is None else float(struct.unpack("<d", content)[0])

    def text(self, number: int) -> str:
        """Return a text; empty where it was left out."""
        return self._bytes.get(number, b"").decode("utf-8")

    def message(self, number: int) -> Fields:
        """Return the fields of a message inside this one; none where it was left out."""
        return Fields(self._bytes.get(number, b""))

    def doubles(self, number: int) -> NDArray[np.float64]:
        """Return a packed array of doubles (n,); empty where it was left out."""
        return np.frombuffer(self._bytes.get(number, b""), dtype="<f8").astype(np.float64)


def integer(number: int, value: int) -> bytes:
    """Return a field with an integer, negative or not."""
    return _key(number, VARINT) + _of_varint(value & (1 << 64) - 1) if value else b""


def double(number: int, value: float) -> bytes:
    """Return a field with a double."""
    return _key(number, DOUBLE) + struct.pack("<d", value) if value else b""


def text(number: int, value: str) -> bytes:
    """Return a field with a text."""
    return message(number, value.encode("utf-8")) if value else b""


def message(number: int, content: bytes) -> bytes:
    """Return a field with a message."""
    return _key(number, BYTES) + _of_varint(len(content)) + content


def doubles(number: int, values: NDArray[np.float64]) -> bytes:
    """Return a field with a packed array of doubles (n,)."""
    return message(number, values.astype("<f8").tobytes()) if len(values) else b""


def _key(number: int, kind: int) -> bytes:
    return _of_varint(number << 3 | kind)


def _of_varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(encoded) + bytes([value])


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return the varint at a place, and the place behind it."""
    value = 0
    for n, byte in enumerate(data[at : at + LONGEST_VARINT]):
        value |= (byte & 0x7F) << 7 * n
        if byte < 0x80:
            return value & (1 << 64) - 1, at + n + 1
    raise ValueError("an integer of a message has no end")
