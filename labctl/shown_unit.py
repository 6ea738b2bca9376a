"""The units in which quantities are shown: one rule for the web pages, the commands and the printed certificates."""

from __future__ import annotations

import re
from typing import NamedTuple

#: Plain numbers that are small angles: how their names begin.
ANGLES = ("misalignment", "non_orthogonality")
#: Plain numbers that are parts of a whole other than the rate: of a band, a step, a law, or of the steps of a table.
PARTS = (
    "dead_band", "missed_steps", "quantization", "saturation", "sine_response", "start_from_rate", "start_of_rate",
    "start_transient",
)  # fmt: skip
#: Plain numbers near 1, or elements of a matrix with ones on its diagonal: they stay as they are.
RATIOS = ("soft iron",)


class ShownUnit(NamedTuple):
    """A shown number is the stored one times `factor`, in `unit`."""

    factor: float
    unit: str

    def scaled(self, value: float | None) -> float | None:
        """Return a stored value as it is shown; None where it is not known."""
        return None if value is None else self.factor * value

    def number(self, value: float, digits: int = 2) -> str:
        """Write a stored value with `digits` significant digits, without the unit: 2000 and not 2e+03 ppm."""
        text = f"{self.factor * value:.{digits}g}"
        return f"{float(text):.0f}" if "e+" in text and self.factor != 1 else text


def _begins_with(stems: tuple[str, ...]) -> re.Pattern[str]:
    """Return what a name matches that begins with one of `stems`, behind an axis or not: x.misalignment_y."""
    return re.compile(rf"(?:[xyz][. ])?(?:{'|'.join(stems)})(?![a-z])")


_KINDS = (
    (_begins_with(ANGLES), ShownUnit(1e3, "mrad")),
    (_begins_with(PARTS), ShownUnit(1e2, "%")),
    (_begins_with(RATIOS), ShownUnit(1.0, "1")),
)


#: A plain number, and one for each of something: 1, 1/K, 1 K^-2.
_PLAIN = re.compile(r"1(?![^ /])")


def shown_unit(unit: str, name: str) -> ShownUnit:
    """Return the unit in which a quantity is shown, whatever its value: the same on every page and in every print.

    `name` is that of the coefficient or effect. Of plain numbers (`unit` "1") angles (`ANGLES`) are in mrad, parts of
    a whole (`PARTS`) in %, `RATIOS` as they are, and all others, which are relative to the rate, in ppm; their changes
    with temperature likewise (`unit` "1/K": ppm/K). An angle in rad is in mrad. `shownUnit` in
    `core/shown_unit.js` of the pages does the same; `tests/pages/shown_units.json` holds both.
    """
    if unit == "rad":
        return ShownUnit(1e3, "mrad")
    if not _PLAIN.match(unit):
        return ShownUnit(1.0, unit)
    factor, shown = next((shown for pattern, shown in _KINDS if pattern.match(name)), ShownUnit(1e6, "ppm"))
    return ShownUnit(factor, shown + unit[1:])


def size_text(value: float, unit: str, name: str, digits: int = 2) -> str:
    """Write a quantity with `digits` significant digits in the unit in which it is shown: 0.31 mrad."""
    shown = shown_unit(unit, name)
    return f"{shown.number(value, digits)} {shown.unit}"
