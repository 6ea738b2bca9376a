"""STIM300 datagrams (data sheet TS1524): scales, and a vectorised scanner for intact frames.

Frames nearly always follow each other at a fixed stride, so the scanner checks the stride first and searches only the
gaps byte by byte. What stands in a gap may be a datagram that a unit sends at its start or when it is asked.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from instruments.protocols.stim300.layouts import LAYOUTS, SPECIALS, Bytes, Layout, crc32_mpeg2
from instruments.protocols.stim300.settings import DatagramOptions, Stim300Settings

__all__ = [
    "LAYOUTS", "Bytes", "DatagramOptions", "Layout", "Scan", "Stim300Settings", "crc32_mpeg2", "int16", "int24",
    "layout_of", "scan",
]  # fmt: skip
CHUNK = 2048  #: frames that are checked together: their tables and columns stay in the cache
AXES = ("x", "y", "z")
RATE_PER_LSB = 2.0**-14  #: deg/s
ANGLE_PER_LSB = 2.0**-21  #: deg, of incremental and integrated angles
TEMPERATURE_PER_LSB = 2.0**-8  #: deg C
COUNTS_PER_S = 2000  #: the counter of a datagram counts internal samples
#: Status bits that make a reading invalid: integrity, start-up, outside conditions, overload, channel error.
BAD_STATUS = 0xF8
OVERLOAD, START_UP = 0x10, 0x40
#: The output saturates at this rate, deg/s; a reading at the rail is not a measurement (data sheet, table 5-3).
SATURATION_DPS = 480.0


SPECIAL_BEGINS = re.compile(b"[" + re.escape(bytes(SPECIALS)) + b"]")


def layout_of(options: DatagramOptions) -> Layout:
    """Return the layout of the datagrams that a unit is configured to send."""
    return replace(LAYOUTS[options.datagram], crlf=options.crlf)


@dataclass(frozen=True)
class Scan:
    """Result of a scan: intact frames (n, stride), unfinished bytes at the end, damage in numbers of frames.

    `behind` (n,) is the number of bytes after each frame.
    """

    frames: Bytes
    rest: bytes
    damaged: int
    behind: NDArray[np.int64]
    specials: tuple[bytes, ...] = ()  #: other datagrams of the unit, without CR LF


def scan(data: bytes, layout: Layout) -> Scan:
    """Find every intact frame in `data`; `rest` holds the unfinished end, for the next scan."""
    raw = np.frombuffer(data, dtype=np.uint8)
    stride, scanned_frames, at, gaps = layout.stride, [], 0, _Gaps(data, layout)
    begins: list[NDArray[np.int64]] = []
    while len(raw) - at >= stride:
        n = min((len(raw) - at) // stride, CHUNK)
        frames = raw[at : at + n * stride].reshape(n, stride)
        good = layout.intact(frames)
        if good.all():
            scanned_frames.append(frames)
            begins.append(at + stride * np.arange(n, dtype=np.int64))
            at += n * stride
            continue
        last = _last_at_stride(good)
        scanned_frames.append(frames[:last][good[:last]])
        begins.append(at + stride * np.flatnonzero(good[:last]))
        for bad in np.flatnonzero(~good[:last]).tolist():
            gaps.add(at + bad * stride, at + (bad + 1) * stride)
        at += last * stride
        ahead = _next_intact(raw, at, layout)
        is_unfinished = False
        if ahead > len(raw) - stride:
            ahead, is_unfinished = _end_of_gap(data, at, ahead)
        gaps.add(at, ahead)
        at = ahead
        if is_unfinished:
            break
    return Scan(
        np.concatenate(scanned_frames) if scanned_frames else np.zeros((0, stride), dtype=np.uint8),
        raw[at:].tobytes(),
        gaps.damaged,
        len(raw) - stride - np.concatenate([np.zeros(0, dtype=np.int64), *begins]),
        tuple(gaps.specials),
    )


class _Gaps:
    """Bytes between the frames: other datagrams of the unit, and damage."""

    def __init__(self, data: bytes, layout: Layout) -> None:
        self._data, self._stride = data, layout.stride
        self._skipped = 0
        self.specials: list[bytes] = []

    @property
    def damaged(self) -> int:
        """Damage in numbers of frames."""
        return -(-self._skipped // self._stride)

    def add(self, start: int, end: int) -> None:
        """Take in that no frame lies between two offsets."""
        skipped = end - start
        while candidate := SPECIAL_BEGINS.search(self._data, start, end):
            start = candidate.start()
            special = special_at(self._data, start)
            if special is None or start + special.stride > end:
                start += 1
                continue
            self.specials.append(self._data[start : start + special.length])
            start += special.stride
            skipped -= special.stride
        self._skipped += max(skipped, 0)


def special_at(data: bytes, at: int) -> Layout | None:
    """Return the layout of the intact special datagram whose identifier is at an offset; None where it is not one."""
    layout = SPECIALS[data[at]]
    if len(data) - at < layout.stride:
        return None
    frame = np.frombuffer(data, dtype=np.uint8, count=layout.stride, offset=at)
    return layout if layout.intact(frame[None])[0] else None


def _end_of_gap(data: bytes, at: int, ahead: int) -> tuple[int, bool]:
    """Return where a gap at the end of the data ends, and whether it ends at an incomplete special datagram.

    No frame begins from `at` to `ahead`. The gap ends at `ahead`, or behind an intact special datagram that reaches
    further, or before an incomplete one.
    """
    done = at
    for candidate in SPECIAL_BEGINS.finditer(data, at):
        start = candidate.start()
        if start >= ahead:
            break
        end = start + SPECIALS[data[start]].stride
        if start >= done and end > len(data):
            return start, True
        if start >= done and special_at(data, start) is not None:
            done, ahead = end, max(ahead, end)
    return ahead, False


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
