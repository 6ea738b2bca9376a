"""STIM300 datagrams (data sheet TS1524): scales, layouts, CRC and a vectorised scanner for intact frames.

The CRC (polynomial 04C11DB7, start FFFFFFFF, most significant bit first, no final exclusive or) is linear over GF(2):
the CRC of a frame is the exclusive or of one table entry for each pair of its bytes. Frames nearly always follow each
other at a fixed stride, so the scanner checks the stride first and searches only the gaps byte by byte.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from instruments.bench_config import GyroSettings, Strict

Bytes = NDArray[np.uint8]
POLYNOMIAL = 0x04C11DB7
CHUNK = 2048  #: frames that are checked together: their tables and columns stay in the cache
AXES = ("x", "y", "z")
RATE_PER_LSB = 2.0**-14  #: deg/s
TEMPERATURE_PER_LSB = 2.0**-8  #: deg C
COUNTS_PER_S = 2000  #: the counter of a datagram counts internal samples
#: Status bits that make a reading invalid: integrity, start-up, outside conditions, overload, channel error.
BAD_STATUS = 0xF8
OVERLOAD = 0x10
#: The output saturates at this rate, deg/s; a reading at the rail is not a measurement (data sheet, table 5-3).
SATURATION_DPS = 480.0


class DatagramOptions(Strict):
    """Configuration of the unit's output: datagram, line end, bit rate in bit/s."""

    datagram: Literal[0x90, 0x94, 0xA7] = 0x94
    crlf: bool = False
    baudrate: int = 460_800


class Stim300Settings(GyroSettings):
    """Settings of a STIM300, as a bench file gives them."""

    options: DatagramOptions = Field(default_factory=DatagramOptions)


def crc32_mpeg2(data: bytes, start: int = 0xFFFFFFFF) -> int:
    """Return the CRC-32/MPEG-2 of bytes, one bit at a time: the definition that the tables are made from."""
    crc = start
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = ((crc << 1) ^ POLYNOMIAL) & 0xFFFFFFFF if crc & 0x80000000 else (crc << 1) & 0xFFFFFFFF
    return crc


@dataclass(frozen=True)
class Layout:
    """Offsets of the fields of a datagram, bytes (data sheet TS1524, section 5.5.6)."""

    id: int
    length: int  #: without CR LF
    pad: int  #: zero bytes that the CRC covers but that are not sent
    status: int
    temperature: int | None
    temperature_status: int | None
    crlf: bool = False

    @property
    def stride(self) -> int:
        """Bytes from one frame to the next."""
        return self.length + (2 if self.crlf else 0)

    @property
    def covered(self) -> int:
        """Bytes before the CRC."""
        return self.length - 4

    @property
    def counter(self) -> int:
        """Offset of the counter."""
        return self.length - 7

    @cached_property
    def _tables(self) -> tuple[int, list[NDArray[np.uint32]]]:
        """Return the CRC of zeros, and a table for each pair of covered bytes (the last may stand alone)."""
        size = self.covered + self.pad
        single = np.zeros((size, 256), dtype=np.uint32)
        for place in range(size):
            bits = [
                crc32_mpeg2(bytes(place) + bytes([1 << bit]) + bytes(size - place - 1), start=0) for bit in range(8)
            ]
            for bit, value in enumerate(bits):
                single[place, (np.arange(256) >> bit) & 1 == 1] ^= np.uint32(value)
        # two bytes read as one little-endian word: the first is the low one
        pairs = [
            (single[place + 1][:, None] ^ single[place][None, :]).reshape(-1) for place in range(0, self.covered - 1, 2)
        ]
        if self.covered % 2:
            pairs.append(single[self.covered - 1])
        return crc32_mpeg2(bytes(size)), pairs

    def crc(self, frames: Bytes) -> NDArray[np.uint32]:
        """Return the CRC, (n,), of frames (n, >= length - 4)."""
        zeros, pairs = self._tables
        words = np.ascontiguousarray(frames[:, : self.covered // 2 * 2]).view("<u2")
        crc = np.full(len(frames), zeros, dtype=np.uint32)
        for index in range(self.covered // 2):
            crc ^= pairs[index].take(words[:, index])
        if self.covered % 2:
            crc ^= pairs[-1].take(frames[:, self.covered - 1])
        return crc

    def intact(self, frames: Bytes) -> NDArray[np.bool_]:
        """Return which frames (n, stride) carry the right id and CRC, (n,)."""
        sent = np.ascontiguousarray(frames[:, self.covered : self.length]).view(">u4")[:, 0]
        return (frames[:, 0] == self.id) & (self.crc(frames) == sent)


LAYOUTS = {
    0x90: Layout(0x90, 18, 2, 10, None, None),
    0x94: Layout(0x94, 25, 3, 10, 11, 17),
    0xA7: Layout(0xA7, 59, 1, 10, 31, 37),
}


def layout_of(options: DatagramOptions) -> Layout:
    """Return the layout of the datagrams that a unit is configured to send."""
    return replace(LAYOUTS[options.datagram], crlf=options.crlf)


@dataclass(frozen=True)
class Scan:
    """Result of a scan: intact frames (n, stride), unfinished bytes at the end, damage in numbers of frames."""

    frames: Bytes
    rest: bytes
    damaged: int


def scan(data: bytes, layout: Layout) -> Scan:
    """Find every intact frame in `data`; `rest` holds the unfinished end, for the next scan."""
    raw = np.frombuffer(data, dtype=np.uint8)
    stride, found, at, skipped = layout.stride, [], 0, 0
    while len(raw) - at >= stride:
        n = min((len(raw) - at) // stride, CHUNK)
        frames = raw[at : at + n * stride].reshape(n, stride)
        good = layout.intact(frames)
        if good.all():
            found.append(frames)
            at += n * stride
            continue
        last = _last_at_stride(good)
        found.append(frames[:last][good[:last]])
        skipped += int((~good[:last]).sum()) * stride
        at += last * stride
        ahead = _next_intact(raw, at, layout)
        skipped += ahead - at
        at = ahead
    return Scan(
        np.concatenate(found) if found else np.zeros((0, stride), dtype=np.uint8),
        raw[at:].tobytes(),
        -(-skipped // stride),
    )


def _last_at_stride(good: NDArray[np.bool_]) -> int:
    """Return how many frames, by mask (n,), the stride may be trusted for.

    One bad frame between good ones is only damaged; where two follow each other, one may hide at another offset.
    """
    hiding = ~good[:-1] & ~good[1:]
    if hiding.any():
        return int(np.argmax(hiding))
    return int(np.flatnonzero(good)[-1]) + 1 if good.any() else 0


def _next_intact(raw: Bytes, at: int, layout: Layout) -> int:
    """Return where the next intact frame begins after `at`, or where an unfinished one may."""
    stride = layout.stride
    end = min(at + 4 * CHUNK, len(raw) - stride + 1)
    if end > at:
        candidates = at + np.flatnonzero(raw[at:end] == layout.id)
        if len(candidates):
            good = layout.intact(raw[candidates[:, None] + np.arange(stride)])
            if good.any():
                return int(candidates[np.argmax(good)])
    return max(end, at)


def int24(frames: Bytes, offset: int, count: int = 3) -> NDArray[np.int32]:
    """Return signed 24-bit numbers, (n, count), big-endian, from `offset` on."""
    wide = np.zeros((len(frames), count, 4), dtype=np.uint8)
    wide[:, :, :3] = frames[:, offset : offset + 3 * count].reshape(len(frames), count, 3)
    return wide.view(">i4")[:, :, 0].astype(np.int32) >> 8


def int16(frames: Bytes, offset: int, count: int = 3) -> NDArray[np.int16]:
    """Return signed 16-bit numbers, (n, count), big-endian, from `offset` on."""
    part = np.ascontiguousarray(frames[:, offset : offset + 2 * count])
    return part.view(">i2").astype(np.int16)
