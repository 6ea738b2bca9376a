"""Checksums of frames and lines by name. CRCs are those of fastcrc: `crc32/mpeg_2`, `crc16/xmodem` and so on."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, reduce
from operator import xor
from typing import NamedTuple

import fastcrc


class Algorithm(NamedTuple):
    """A checksum: its width in bytes, and the number that it makes of bytes."""

    size: int
    of: Callable[[bytes], int]


#: `sum8` and `sum16` add all bytes; `sum8-zero` makes the sum of all bytes and itself zero, as Xsens does.
_SUMS: dict[str, Algorithm] = {
    "xor8": Algorithm(1, lambda data: reduce(xor, data, 0)),
    "sum8": Algorithm(1, lambda data: sum(data) & 0xFF),
    "sum8-zero": Algorithm(1, lambda data: -sum(data) & 0xFF),
    "sum16": Algorithm(2, lambda data: sum(data) & 0xFFFF),
}
_CRCS = {"crc8": 1, "crc16": 2, "crc32": 4, "crc64": 8}


def algorithm_names() -> list[str]:
    """Return the name of every checksum."""
    crcs = [f"{group}/{name}" for group in _CRCS for name in sorted(getattr(fastcrc, group).algorithms_available)]
    return [*_SUMS, *crcs]


@cache
def algorithm(name: str) -> Algorithm:
    """Return a checksum by name; raises ValueError saying which there are."""
    if name in _SUMS:
        return _SUMS[name]
    group, _, one = name.partition("/")
    if group not in _CRCS or one not in getattr(fastcrc, group).algorithms_available:
        algorithms = [algorithm_name for algorithm_name in algorithm_names() if algorithm_name.startswith(group)] or [
            *_SUMS,
            "crc32/mpeg_2 ...",
        ]
        raise ValueError(f"checksum {name!r} is not known; choose one of {', '.join(algorithms)}")
    of: Callable[[bytes], int] = getattr(getattr(fastcrc, group), one)
    return Algorithm(_CRCS[group], of)
