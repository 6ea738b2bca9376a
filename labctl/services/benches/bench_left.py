"""How a bench was left when its service or campaign ended."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BenchLeft:
    """How a bench was left: in words, nothing where there is none, and whether it is not known to be safe."""

    text: str = ""
    unconfirmed: bool = False
