"""Figures of a maker's data sheet: what a figure means, and the standard uncertainty that follows from it.

The same number is another promise as one standard deviation, as a maximum, from peak to peak or as a typical value. A
recording or a bench file states the convention of each of its figures; where it does not, the convention of the maker's
own data sheet holds, and for an unknown maker one standard deviation, of which nothing is taken off.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Convention = Literal["1 sigma", "maximum", "peak to peak", "typical"]

#: Standard uncertainty over the figure, and why. A typical figure is that of the unit in the middle of many: the chance
#: to be within it is fifty-fifty, and a normal distribution has 1.48 times it for a standard deviation.
_U_OVER_FIGURE: dict[Convention, tuple[float, str]] = {
    "1 sigma": (1.0, "u is the figure"),
    "maximum": (1.0 / math.sqrt(3.0), "rectangular within plus and minus the figure, u = figure / sqrt(3), GUM 4.3.7"),
    "peak to peak": (
        1.0 / math.sqrt(12.0),
        "rectangular within plus and minus half the figure, u = figure / sqrt(12), GUM 4.3.7",
    ),
    "typical": (1.48, "half of the units are taken to be within it, u = 1.48 times the figure, GUM 4.3.5"),
}


@dataclass(frozen=True)
class MakerSheet:
    """Convention of a maker's data sheets: of some figures by name, of all others, and the sheet that says so."""

    named: Mapping[str, Convention]
    others: Convention
    source: str


#: Conventions that state a limit.
LIMITS: frozenset[Convention] = frozenset({"maximum", "peak to peak"})
#: By a word of the model's name, in small letters.
MAKERS: dict[str, MakerSheet] = {
    "kvh": MakerSheet(
        {"bias_repeatability_dps": "peak to peak"}, "1 sigma", "KVH's data sheet, by Ojeda et al. 2000, Table I"
    ),
    "sensonor": MakerSheet({}, "typical", "Sensonor's data sheet TS1524, column of nominal values"),
    "": MakerSheet({}, "1 sigma", "no convention is stated, and the maker's is not known"),
}


@dataclass(frozen=True)
class DatasheetFigure:
    """One figure of a data sheet with its convention."""

    name: str  #: with its unit, such as bias_stability_dps
    value: float
    convention: Convention
    source: str  #: who says that it is this convention; empty: the recording itself

    @property
    def u(self) -> float:
        """Standard uncertainty that the figure states, in its unit."""
        return _U_OVER_FIGURE[self.convention][0] * self.value

    @property
    def text(self) -> str:
        """The figure, its convention, where that is from, and what follows from it."""
        name, _, unit_symbol = self.name.rpartition("_")
        words = f"{name.replace('_', ' ')} {self.value:g} {'deg/s' if unit_symbol == 'dps' else unit_symbol}"
        by = f" ({self.source})" if self.source else ""
        return f"{words}, {self.convention}{by}: {_U_OVER_FIGURE[self.convention][1]}"


def datasheet_figure(
    name: str, figures: Mapping[str, float], conventions: Mapping[str, Convention], model: str
) -> DatasheetFigure | None:
    """Return a figure of a data sheet with its convention; None where there is none, or 0.

    `conventions` are those stated, name -> convention; the others follow from the maker in the name of the `model`.
    """
    value = figures.get(name)
    if not value:
        return None
    if name in conventions:
        return DatasheetFigure(name, float(value), conventions[name], "")
    sheet = next(sheet for maker, sheet in MAKERS.items() if maker in model.lower())
    return DatasheetFigure(name, float(value), sheet.named.get(name, sheet.others), sheet.source)


def undeclared(figures: Mapping[str, float], conventions: Mapping[str, str]) -> str:
    """Return which conventions have no figure; empty where each has one."""
    without_figure = sorted(set(conventions) - set(figures))
    return (
        f"{', '.join(without_figure)}: the data sheet has no such figure; state it in datasheet, or remove it"
        if without_figure
        else ""
    )
