"""CAN frames as bytes: 16 each, in the layout of `struct can_frame` of Linux (linux/can.h), little-endian.

Identifier with the flags EFF (extended), RTR (request) and ERR (error frame), number of data bytes, three zeros, eight
data bytes. A frame of CAN FD does not fit.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

import numpy as np

EXTENDED, REQUEST, ERROR = 0x80000000, 0x40000000, 0x20000000
FRAME_BYTES, MAX_DATA = 16, 8
STANDARD_IDS, EXTENDED_IDS = 0x7FF, 0x1FFFFFFF
#: Classes of an error frame: bits of its identifier (linux/can/error.h).
BUS_OFF = 0x40
ERROR_CLASSES = {
    0x01: "transmission timed out", 0x02: "arbitration lost", 0x04: "controller problem", 0x08: "protocol violation",
    0x10: "transceiver problem", 0x20: "no acknowledgement", BUS_OFF: "bus-off", 0x80: "bus error",
    0x100: "controller restarted",
}  # fmt: skip

_LAYOUT = struct.Struct("<IB3x8s")
_RECORD = np.dtype([("id", "<u4"), ("length", "u1"), ("zero", "u1", 3), ("data", "u1", 8)])


class CanFrame(NamedTuple):
    """One frame: `id` with the flag EXTENDED for one of 29 bits; an error frame has ERROR and its classes."""

    id: int
    data: bytes


def packed(frame: CanFrame) -> bytes:
    """Return the 16 bytes of a frame; raises ValueError for more than 8 data bytes."""
    if len(frame.data) > MAX_DATA:
        raise ValueError(f"a CAN frame holds at most {MAX_DATA} data bytes, not {len(frame.data)}; shorten the data")
    return _LAYOUT.pack(frame.id, len(frame.data), frame.data)


def frame_of_text(text: str) -> CanFrame:
    """Return the frame of a text as `cansend` of can-utils takes it, such as 123#DEADBEEF; raises ValueError.

    Three hexadecimal digits are a standard identifier, eight an extended one.
    """
    digits, mark, data = text.partition("#")
    try:
        id_, content = int(digits, 16), bytes.fromhex(data)
    except ValueError:
        id_, content, mark = 0, b"", ""
    highest = {3: STANDARD_IDS, 8: EXTENDED_IDS}.get(len(digits), -1)
    if not mark or not 0 <= id_ <= highest or len(content) > MAX_DATA:
        raise ValueError(
            f"{text!r} is not a CAN frame; write three (standard) or eight (extended) hexadecimal digits, #, and up to "
            f"{MAX_DATA} bytes, such as 000#0100"
        )
    return CanFrame(id_ | (EXTENDED if len(digits) == 8 else 0), content)


class FrameScanner:
    """Takes the bytes of a port as they come, and returns whole frames; bytes that are none are passed over."""

    def __init__(self) -> None:
        self._rest = b""

    def drop(self) -> None:
        """Drop the unfinished frame."""
        self._rest = b""

    @property
    def waiting(self) -> int:
        """How many bytes of the unfinished frame have come."""
        return len(self._rest)

    def feed(self, data: bytes) -> tuple[list[CanFrame], int]:
        """Return every frame that is whole now, and in how many places there were bytes that are no frame."""
        data, at, damaged = self._rest + data, 0, 0
        frames: list[CanFrame] = []
        while (n := (len(data) - at) // FRAME_BYTES) > 0:
            good = _good(np.frombuffer(data, _RECORD, n, at))
            whole = n if good.all() else int(np.argmin(good))
            frames += (_frame(data, at + FRAME_BYTES * each) for each in range(whole))
            at += FRAME_BYTES * whole
            if whole < n:
                damaged += 1
                at += 1
                while len(data) - at >= FRAME_BYTES and not _is_frame(data, at):
                    at += 1
        self._rest = data[at:]
        return frames, damaged


def _is_frame(data: bytes, at: int) -> bool:
    return data[at + 4] <= MAX_DATA and bool(_good(np.frombuffer(data, _RECORD, 1, at))[0])


def _good(records: np.ndarray) -> np.ndarray:
    """Return which records (n,) are frames: identifier, length and unused bytes are what they must be."""
    ids, lengths = records["id"], records["length"]
    standard = (ids & (EXTENDED | ERROR)) == 0
    unused = np.arange(MAX_DATA) >= lengths[:, None]
    good: np.ndarray = (lengths <= MAX_DATA) & ~records["zero"].any(axis=1)
    good &= ~(standard & ((ids & EXTENDED_IDS) > STANDARD_IDS))
    good &= ~((records["data"] != 0) & unused).any(axis=1)
    return good


def _frame(data: bytes, at: int) -> CanFrame:
    id_, length, content = _LAYOUT.unpack_from(data, at)
    return CanFrame(id_, content[:length])
