"""The units in which quantities are shown: one rule for the web pages, the commands and the printed certificates."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

#: A share of this size or more is written in %, less in ppm.
MIN_PERCENT = 0.01


class ShownUnit(NamedTuple):
    """A shown number is the stored one times `factor`, in `unit`."""

    factor: float
    unit: str


def shown_unit(unit: str, values: Iterable[float | None], name: str = "") -> ShownUnit:
    """Return the unit in which all quantities of one kind are shown, so that a column of them compares.

    Plain numbers (`unit` "1") are angles in mrad for a misalignment; other shares are in %, or in ppm where none of
    `values` reaches 1 %. `shownUnit` in `core/format.js` of the pages does the same; `tests/pages/shown_units.json`
    holds both.
    """
    if unit != "1":
        return ShownUnit(1.0, unit)
    if name.startswith("misalignment"):
        return ShownUnit(1e3, "mrad")
    sizes = [abs(value) for value in values if value is not None and math.isfinite(value)]
    return ShownUnit(1e2, "%") if max(sizes, default=0.0) >= MIN_PERCENT else ShownUnit(1e6, "ppm")
