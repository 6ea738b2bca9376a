"""A figure with its standard uncertainty."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A value and its standard uncertainty, in the unit of the value; None: too few data sets to tell."""

    value: float
    u: float | None
