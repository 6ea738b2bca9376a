"""Coefficients that one cause shifts together: the same coefficient of several axes, or at several temperatures.

A rate table that turns 100 ppm too slowly shifts the scale factors of all axes, at all temperatures, by the same 1e-4.
The mean of such coefficients is one more quantity of each unit, in which a common shift shows better than in any.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from labctl.fitting.fleet.unit_coefficients import UnitTable
from labctl.fitting.numeric.arrays import Array

_NAME = re.compile(r"^(?:(?P<axis>[^.@]+)\.)?(?P<name>[^@]+)(?:@.*)?$")


@dataclass(frozen=True)
class Direction:
    """Coefficients of one kind, whose mean is a quantity of its own."""

    name: str
    places: tuple[int, ...]  #: of the coefficients
    values: Array  #: (n,) mean of them of each unit
    variance: Array  #: (n,) by the units' own calibrations


def kind_of_coefficient(name: str) -> str:
    """Return a coefficient's name without axis and temperature: `scale_factor` of `x.scale_factor@25`."""
    match = _NAME.match(name)
    return name if match is None else match["name"]


def directions_of(table: UnitTable) -> tuple[Direction, ...]:
    """Return the kinds of coefficients of which a table of units has several."""
    places: dict[tuple[str, str], list[int]] = {}
    for k, (name, unit_symbol) in enumerate(zip(table.names, table.units, strict=True)):
        places.setdefault((kind_of_coefficient(name), unit_symbol), []).append(k)
    directions = []
    for (kind, _), own in places.items():
        if len(own) > 1:
            variance = table.covariance[:, own][:, :, own].sum(axis=(1, 2)) / len(own) ** 2
            directions.append(Direction(kind, tuple(own), table.values[:, own].mean(axis=1), np.maximum(variance, 0.0)))
    return tuple(directions)
