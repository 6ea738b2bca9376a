"""Numbers and arrays as JSON values."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

DIGITS = 5


def plain(value: float | np.floating) -> float | None:
    """Return a number rounded to a few significant digits; None where it is not finite."""
    number = float(value)
    return float(f"{number:.{DIGITS}g}") if math.isfinite(number) else None


def plain_list(values: ArrayLike) -> list[float | None]:
    """Return numbers (n,) rounded to a few significant digits; None where one is not finite."""
    return [plain(value) for value in np.asarray(values, dtype=np.float64).tolist()]


def none_for_nan(values: NDArray[np.float64]) -> list[list[float | None]]:
    """Return a table (n, m) as lists at full precision, None in place of NaN, which JSON does not have."""
    return [[None if math.isnan(value) else value for value in row] for row in values.tolist()]
