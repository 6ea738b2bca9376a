"""Readings from binary frames: fixed or said length, checksum, fields in place or in items.

Frames of one length nearly always follow each other, so that they are checked and decoded together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from instruments.protocols.stream_formats.checksums import algorithm
from instruments.protocols.stream_formats.document import (
    LONGEST_FRAME,
    BytesField,
    FrameLayout,
    LengthField,
    StreamFormat,
    hex_bytes,
)
from instruments.protocols.stream_formats.readings import Decoded, Whole, flags, step_of, whole_numbers

Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]
#: Frames that are checked together.
CHUNK = 512


class FrameScanner:
    """Finds the intact frames in the bytes of a stream."""

    def __init__(self, layout: FrameLayout) -> None:
        self._layout = layout
        self._sync, self._trailer = hex_bytes(layout.sync), hex_bytes(layout.trailer)
        self._algorithm = None if layout.checksum is None else algorithm(layout.checksum.algorithm)
        self._least = layout.length if isinstance(layout.length, int) else layout.length.plus
        self._typical = self._least
        self._unfinished, self._in_step = b"", False
        self._skipped = 0  #: bytes since the last intact frame

    def drop(self) -> None:
        """Drop the unfinished frame; bytes before the next intact one are no damage."""
        self._unfinished, self._in_step, self._skipped = b"", False, 0

    def feed(self, new: bytes) -> tuple[list[tuple[Bytes, Whole]], int]:
        """Return the intact frames in blocks (n, length) of equal length, and the damage in numbers of frames.

        Beside each block is how many bytes arrived after each of its frames (n,).
        """
        data = self._unfinished + new
        raw = np.frombuffer(data, dtype=np.uint8)
        blocks: list[tuple[Bytes, Whole]] = []
        at = between = 0
        while True:
            start = data.find(self._sync, at)
            if start < 0:
                kept = len(self._sync) - 1
                start = max(at, len(data) - kept)
            self._skipped += start - at
            at = start
            length = self._length_at(data, at)
            if length is None or at + length > len(data):
                break
            n = min((len(data) - at) // length, CHUNK)
            good = self._leading(data, raw[at : at + n * length].reshape(n, length), at) if length else 0
            if not good:
                self._skipped += 1
                at += 1
                continue
            between, self._skipped = between + self._skipped * self._in_step, 0
            frames = raw[at : at + good * length].reshape(good, length)
            blocks.append((frames, len(data) - at - length * np.arange(1, good + 1)))
            self._typical, self._in_step = length, True
            at += good * length
        if self._skipped >= 2 * self._typical:  # nothing fits any more: say so without waiting for a whole frame
            between, self._skipped = between + self._skipped * self._in_step, 0
        self._unfinished = data[at:]
        return blocks, -(-between // max(self._typical, 1))

    def _length_at(self, data: bytes, at: int) -> int | None:
        """Return how long the frame at an offset says it is; 0 where that cannot be, None where it is not there yet."""
        law = self._layout.length
        if isinstance(law, int):
            return law
        size = 1 if law.type == "u8" else 2
        where = at + law.at
        if where + size > len(data):
            return None
        length = int.from_bytes(data[where : where + size], self._layout.byte_order) + law.plus
        return length if len(self._sync) < length <= LONGEST_FRAME else 0

    def _leading(self, data: bytes, frames: Bytes, at: int) -> int:
        """Return how many frames (n, length), from offset `at` on, are intact before the first that is not."""
        good = (frames[:, : len(self._sync)] == np.frombuffer(self._sync, np.uint8)).all(axis=1)
        if self._trailer:
            good &= (frames[:, -len(self._trailer) :] == np.frombuffer(self._trailer, np.uint8)).all(axis=1)
        if isinstance(self._layout.length, LengthField):
            where = slice(self._layout.length.at, self._layout.length.at + (self._layout.length.type == "u16") + 1)
            good &= (frames[:, where] == frames[0, where]).all(axis=1)
        n = len(good) if good.all() else int(np.argmin(good))
        if self._algorithm is None or self._layout.checksum is None:
            return n
        length, first = frames.shape[1], self._layout.checksum.start
        end, of = self._layout.content_end(length), self._algorithm.of
        size, order = self._algorithm.size, self._layout.checksum.byte_order or self._layout.byte_order
        for index in range(n):
            begin = at + index * length
            sent = data[begin + end : begin + end + size]
            if of(data[begin + first : begin + end]) != int.from_bytes(sent, order):
                return index
        return n


def raw_numbers(frames: Bytes, offset: int, field: BytesField, order: str) -> tuple[Whole, Mask]:
    """Return the whole numbers (n,) of a field, at an offset of frames (n, length), and which are numbers."""
    big = (field.byte_order or order) == "big"
    part = frames[:, offset : offset + field.size]
    if field.size == 3:
        wide = np.zeros((len(frames), 4), dtype=np.uint8)
        wide[:, :3] = part if big else part[:, ::-1]
        whole = wide.view(">i4")[:, 0].astype(np.int64) >> 8
        return (whole & 0xFFFFFF if field.type == "u24" else whole), np.ones(len(frames), dtype=bool)
    kind = f"{'>' if big else '<'}{field.type[0]}{field.size}"
    values = np.ascontiguousarray(part).view(kind)[:, 0]
    if field.is_float:
        return whole_numbers(values.astype(np.float64), step_of(field))
    return values.astype(np.int64), np.ones(len(frames), dtype=bool)


class _Part(NamedTuple):
    """Readings of frames of one structure: field -> (n,); which are numbers (n,); bytes after each frame (n,)."""

    values: dict[str, Whole]
    good: Mask
    behind: Whole


class FrameDecoder:
    """Decodes the frames of a format."""

    def __init__(self, format_: StreamFormat) -> None:
        assert format_.frame is not None
        self._format, self._layout = format_, format_.frame
        self._scanner = FrameScanner(self._layout)
        self._held: dict[str, int] = {}  #: newest value of the fields that come more rarely

    def drop(self) -> None:
        """Drop the unfinished frame."""
        self._scanner.drop()

    def feed(self, data: bytes) -> Decoded:
        """Return the readings of every frame that is whole now."""
        blocks, damaged = self._scanner.feed(data)
        parts = [part for frames, behind in blocks for part in self._decoded(frames, behind)]
        names = [field.name for field in self._layout.fields]
        empty = np.zeros(0, dtype=np.int64)
        values = {name: np.concatenate([empty, *(part.values[name] for part in parts)]) for name in names}
        good = np.concatenate([np.zeros(0, dtype=bool), *(part.good for part in parts)])
        behind = np.concatenate([empty, *(part.behind for part in parts)])
        return Decoded(values, flags(self._format, values, good), behind, damaged)

    def _decoded(self, frames: Bytes, behind: Whole) -> list[_Part]:
        """Return the numbers of consecutive frames of one length, in parts of equal structure; others are dropped."""
        parts = []
        while len(frames):
            n, items = self._alike(frames)
            if (part := self._part(frames[:n], behind[:n], items)) is not None:
                parts.append(part)
            frames, behind = frames[n:], behind[n:]
        return parts

    def _alike(self, frames: Bytes) -> tuple[int, dict[int, int]]:
        """Return how many frames have their items where the first has them, and the offset of each item's data."""
        items = self._layout.items
        if items is None:
            return len(frames), {}
        same = np.ones(len(frames), dtype=bool)
        first = frames[0].tobytes()
        offsets: dict[int, int] = {}
        at, end = items.at, self._layout.content_end(frames.shape[1])
        id_size, size_size = int(items.id_type[1:]) // 8, int(items.size_type[1:]) // 8
        while at + id_size + size_size <= end:
            data = at + id_size + size_size
            offsets.setdefault(int.from_bytes(first[at : at + id_size], self._layout.byte_order), data)
            same &= (frames[:, at:data] == frames[0, at:data]).all(axis=1)
            at = data + int.from_bytes(first[at + id_size : data], self._layout.byte_order)
        return (len(frames) if same.all() else int(np.argmin(same))), offsets

    def _part(self, frames: Bytes, behind: Whole, items: dict[int, int]) -> _Part | None:
        """Return the readings of frames of one structure; None for other messages."""
        values: dict[str, Whole] = {}
        good = np.ones(len(frames), dtype=bool)
        is_reading = np.ones(len(frames), dtype=bool)
        for field in self._layout.fields:
            offset = 0 if field.item is None else items.get(field.item)
            if offset is None or offset + field.at + field.size > self._layout.content_end(frames.shape[1]):
                if not field.hold or field.name not in self._held:
                    return None
                values[field.name] = np.full(len(frames), self._held[field.name], dtype=np.int64)
                continue
            numbers, fits = raw_numbers(frames, offset + field.at, field, self._layout.byte_order)
            if field.equals is not None:
                is_reading &= numbers == field.equals
            good &= fits
            values[field.name] = numbers
            if field.hold:
                self._held[field.name] = int(numbers[-1])
        kept = {name: value[is_reading] for name, value in values.items()}
        return _Part(kept, good[is_reading], behind[is_reading])
