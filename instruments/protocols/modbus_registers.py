"""Modbus registers as data: number, meaning, type, unit, range, access and source; encoding of their words."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from typing import Literal

WordOrder = Literal["little", "big"]  #: of 32-bit floats: low word first, or high word first

MIN_NORMAL = 2.0**-126  #: of a 32-bit float


@dataclass(frozen=True)
class Register:
    """One quantity of an instrument, as its manual lists it. The number is sent as written (zero-based)."""

    number: int
    meaning: str
    kind: Literal["int16", "uint16", "uint32", "float32"] = "uint16"
    unit: str = ""
    low: float = -float("inf")  #: lowest and highest value that the register can hold, in `unit` or counts
    high: float = float("inf")
    access: Literal["r", "rw", "w"] = "r"
    source: str = ""  #: manual or project that the number is from
    read_function: Literal[3, 4] = 3
    below: str = ""  #: what a value below `low` stands for

    @property
    def words(self) -> int:
        """Number of 16-bit words of the value."""
        return 2 if self.kind in ("float32", "uint32") else 1

    def nth(self, n: int, stride: int, *, first: int = 1) -> Register:
        """Return the register of the `n`-th of several equal inputs, events or alarms, counted from `first`."""
        return replace(self, number=self.number + stride * (n - first), meaning=f"{self.meaning} {n}")

    def read_by(self, function: Literal[3, 4]) -> Register:
        """Return the same register, read by another function code."""
        return replace(self, read_function=function)

    def holds(self, value: float) -> bool:
        """Return whether a value lies within the range of the register; NaN never does."""
        return self.low <= value <= self.high

    def is_plausible(self, value: float) -> bool:
        """Return whether a value can be a measurement: in range, and no denormal float (exchanged words give those)."""
        return self.holds(value) and not 0 < abs(value) < MIN_NORMAL

    def decode(self, words: list[int], order: WordOrder) -> float:
        """Return the value of unsigned words, in `unit` or counts."""
        if self.kind == "float32":
            high, low = words if order == "big" else reversed(words)
            (value,) = struct.unpack(">f", struct.pack(">HH", high, low))
            return float(value)
        if self.kind == "uint32":
            high, low = words if order == "big" else reversed(words)
            return high << 16 | low
        return words[0] - 0x10000 if self.kind == "int16" and words[0] >= 0x8000 else words[0]

    def encode(self, value: float, order: WordOrder) -> list[int]:
        """Return the unsigned words of a value; an integer is encoded as two's complement."""
        if self.kind == "float32":
            high, low = struct.unpack(">HH", struct.pack(">f", value))
            return [high, low] if order == "big" else [low, high]
        if self.kind == "uint32":
            high, low = round(value) >> 16 & 0xFFFF, round(value) & 0xFFFF
            return [high, low] if order == "big" else [low, high]
        return [round(value) & 0xFFFF]

    def __str__(self) -> str:
        return f"{self.meaning} (register {self.number})"
