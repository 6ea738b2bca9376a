"""The block codec: named columns to bytes and back, exactly.

Whole numbers stay whole numbers, as the device sent them. Each column is brought to small numbers (a constant, an even
ramp, or what it is above its smallest value), columns of the same width are laid side by side, and bitshuffle with zstd
takes out what repeats. White noise of a gyro cannot be packed below its entropy; everything else nearly vanishes.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.errors import StoreError

CODEC = 1
#: Compression effort while readings come in, and when a finished data set is packed for good.
LIVE, FINAL = 0, 6
_HEAD = struct.Struct("<I")


@dataclass(frozen=True)
class Block:
    """Packed columns: how many rows, how packed, a checksum, and the bytes."""

    n: int
    codec: int
    crc32: int
    data: bytes


def pack(columns: Mapping[str, NDArray[np.generic]], effort: int = LIVE) -> Block:
    """Pack columns (n,) of whole numbers, floats or words."""
    n = len(next(iter(columns.values()), ()))
    heads: list[list[object]] = []
    groups: dict[str, list[NDArray[np.generic]]] = {}
    for name, values in columns.items():
        if values.dtype.kind in "iub":
            how, residue = _shrink(values.astype(np.int64))
        elif values.dtype.kind == "f":
            how, residue = ["f"], values.astype(np.float64)
        else:
            how, residue = ["w", [str(word) for word in values]], None
        width = residue.dtype.str if residue is not None else ""
        heads.append([name, width, *how])
        if residue is not None:
            groups.setdefault(width, []).append(residue)
    parts = [_compress(np.stack(group), effort) for _, group in sorted(groups.items())]
    head = json.dumps([heads, [len(part) for part in parts], effort], separators=(",", ":")).encode()
    data = _HEAD.pack(len(head)) + head + b"".join(parts)
    return Block(n, CODEC, zlib.crc32(data), data)


def unpack(block: Block) -> dict[str, NDArray[np.generic]]:
    """Return the columns of a block; raises StoreError when its bytes are not those that were written."""
    if zlib.crc32(block.data) != block.crc32:
        raise StoreError("a block of readings is damaged: its checksum is wrong; restore the newest backup")
    if block.codec != CODEC:
        raise StoreError(
            f"a block of readings is stored with codec {block.codec}, but this version of labctl reads only "
            f"{CODEC}; use a newer version"
        )
    (size,) = _HEAD.unpack_from(block.data)
    heads, lengths, effort = json.loads(block.data[_HEAD.size : _HEAD.size + size])
    at, widths = _HEAD.size + size, sorted({head[1] for head in heads if head[1]})
    stacks: dict[str, Any] = {}
    for width, length in zip(widths, lengths, strict=True):
        rows = sum(head[1] == width for head in heads)
        raw = _decompress(block.data[at : at + length]) if effort else block.data[at : at + length]
        stacks[width] = iter(np.frombuffer(raw, dtype=width).reshape(rows, block.n))
        at += length
    return {head[0]: _restore(head, next(stacks[head[1]]) if head[1] else None, block.n) for head in heads}


def load_compressor() -> None:
    """Import the compression library now: a process may be able to open no further file once readings come."""
    import blosc2  # noqa: F401, PLC0415  0.1 s that only readings need


def _compress(stack: NDArray[np.generic], effort: int) -> bytes:
    if stack.size == 0:
        return b""
    if effort == 0:
        return stack.tobytes()
    import blosc2  # noqa: PLC0415  as above

    packed: bytes = blosc2.compress2(
        np.ascontiguousarray(stack),
        codec=blosc2.Codec.ZSTD,
        clevel=effort,
        filters=[blosc2.Filter.BITSHUFFLE],
        typesize=stack.dtype.itemsize,
        nthreads=1,
    )
    return packed


def _decompress(data: bytes) -> bytes:
    import blosc2  # noqa: PLC0415  as above

    return bytes(blosc2.decompress2(data, nthreads=1)) if data else b""


def _shrink(values: NDArray[np.int64]) -> tuple[list[Any], NDArray[np.generic] | None]:
    """Return how to restore whole numbers (n,), and what is left of them: nothing, or small unsigned numbers."""
    if len(values) == 0:
        return ["c", 0], None
    low, high = int(values.min()), int(values.max())
    if low == high:
        return ["c", low], None
    ramp = _even_ramp(values)
    if ramp is not None:
        return ["r", *ramp], None
    if high - low < 2**63:
        return ["o", low], _narrow((values - low).astype(np.uint64), high - low)
    return ["o", 0], values.view(np.uint64)


def _even_ramp(values: NDArray[np.int64]) -> tuple[int, int, int] | None:
    """Return (first, numerator, denominator) when all values are first + i * numerator // denominator."""
    steps = len(values) - 1
    first, span = int(values[0]), int(values[-1]) - int(values[0])
    if abs(span) >= 2**62 // max(steps, 1):
        return None
    if abs(int(values[1]) - first - span // steps) > 1:
        return None
    index = np.arange(len(values), dtype=np.int64)
    return (first, span, steps) if np.array_equal(values, first + (index * span) // steps) else None


def _narrow(values: NDArray[np.uint64], most: int) -> NDArray[np.generic]:
    for kind, limit in ((np.uint8, 2**8), (np.uint16, 2**16), (np.uint32, 2**32)):
        if most < limit:
            return values.astype(kind)
    return values


def _restore(head: list[Any], residue: NDArray[np.generic] | None, n: int) -> NDArray[np.generic]:
    kind = head[2]
    if kind == "c":
        return np.full(n, head[3], dtype=np.int64)
    if kind == "r":
        first, span, steps = head[3:]
        return np.asarray(first + (np.arange(n, dtype=np.int64) * span) // steps)
    if kind == "w":
        return np.asarray(head[3], dtype=np.str_)
    assert residue is not None
    if kind == "f":
        return residue.copy()
    if residue.itemsize < np.dtype(np.int64).itemsize:
        return np.add(residue, np.int64(head[3]), dtype=np.int64)
    return residue.astype(np.uint64).view(np.int64) + np.int64(head[3])  # may go beyond 2**63 and come back
