"""A result rounded to its uncertainty (GUM 7.2.6): the uncertainty to two significant digits, the value to its place.

The pages round by the same rule (`labctl/web/static/js/core/rounding.js`); a test compares the two.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Results below 10^-4 or from 10^6 on are written with a power of ten.
MIN_POWER, MAX_POWER = -4, 5
MAX_DECIMALS = 12
#: Significant digits of a value without an uncertainty.
DIGITS = 4
#: Digits of a bound that is said; it is rounded up.
BOUND_DIGITS = 3


@dataclass(frozen=True)
class Rounded:
    """A value and its uncertainty as texts that count in units of 10^exponent; `u` is None where it is unknown."""

    value: str
    u: str | None
    exponent: int

    @property
    def power(self) -> str:
        """The power of ten as a suffix: "e-7", or nothing."""
        return f"e{self.exponent}" if self.exponent else ""


def rounded_to_uncertainty(value: float, uncertainty: float | None) -> Rounded:
    """Return a value rounded to its uncertainty; without a known one (None, 0 or not finite) to four digits."""
    has_u = uncertainty is not None and math.isfinite(uncertainty) and uncertainty > 0
    u = float(f"{uncertainty:.1e}") if has_u else 0.0  # two significant digits, so 0.0999 is 0.10
    largest = max(abs(value), u)
    size = math.floor(math.log10(largest)) if largest > 0 else 0
    exponent = size if size < MIN_POWER or size > MAX_POWER else 0
    if not has_u:
        return Rounded(f"{float(f'{value / 10.0**exponent:.{DIGITS}g}'):.12g}", None, exponent)
    place = int(f"{u:.1e}".split("e")[1]) - exponent - 1  # of the second significant digit
    decimals, last_digit = min(max(-place, 0), MAX_DECIMALS), 10.0 ** max(place, 0)
    texts = [f"{round(number / 10.0**exponent / last_digit) * last_digit:.0f}" if place > 0 else
             f"{number / 10.0**exponent:.{decimals}f}" for number in (value, u)]  # fmt: skip
    return Rounded(texts[0], texts[1], exponent)


def at_most(size: float) -> float:
    """Return a size rounded up to three digits, so that it stays a bound."""
    if size <= 0 or not math.isfinite(size):
        return size
    step = 10.0 ** (math.floor(math.log10(size)) + 1 - BOUND_DIGITS)
    return float(f"{math.ceil(size / step * (1 - 1e-12)) * step:.{BOUND_DIGITS}g}")
