"""Coefficients of a model that are held at known values: a fit subtracts what they cause and estimates the others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.models.temperature import LagrangeTable, TemperatureBasis

if TYPE_CHECKING:
    from labctl.answers.fitted_model import HeldCoefficientJson, HeldJson

#: Temperatures between which a held table is interpolated, where it has as many.
POINTS = 3


@dataclass(frozen=True)
class HeldCoefficient:
    """One coefficient: p values, each with its standard uncertainty; p is 1, or the temperatures of a table."""

    value: tuple[float, ...]
    u: tuple[float, ...]  #: NaN: not stated
    unit: str = ""
    effect: str = ""  #: the effect that it belongs to
    temperature_c: tuple[float, ...] = ()  #: of a table, rising; empty: one value for all temperatures

    def spread(self, temperature: TemperatureBasis) -> NDArray[np.float64]:
        """Return the matrix (nodes, p) from its values to those at the nodes of a model."""
        nodes = np.asarray(temperature.nodes_c) if isinstance(temperature, LagrangeTable) else np.zeros(1)
        if not self.temperature_c:
            return np.ones((len(nodes), 1))
        return LagrangeTable(self.temperature_c, min(POINTS, len(self.temperature_c))).basis(nodes)

    @property
    def has_u(self) -> bool:
        """Whether the standard uncertainty of every value is stated."""
        return not any(map(math.isnan, self.u))


@dataclass(frozen=True)
class Held:
    """The coefficients that a model holds: output axis -> name -> coefficient; where they are from."""

    axes: Mapping[str, Mapping[str, HeldCoefficient]] = field(default_factory=dict)
    source: str = ""

    def of(self, axis: str, effect: str, name: str) -> HeldCoefficient | None:
        """Return a held coefficient; None for one that is estimated."""
        held_coefficient = self.axes.get(axis, {}).get(name)
        return held_coefficient if held_coefficient is not None and held_coefficient.effect == effect else None

    @property
    def effects(self) -> frozenset[str]:
        """The effects of which coefficients are held."""
        return frozenset(one.effect for names in self.axes.values() for one in names.values())

    def without_u(self, axis: str) -> tuple[str, ...]:
        """Return the names of an axis' held coefficients that state no uncertainty."""
        return tuple(name for name, one in self.axes.get(axis, {}).items() if not one.has_u)

    def beside(self, effects: tuple[str, ...]) -> Held:
        """Return what is held without the coefficients of some effects."""
        remaining = {
            axis: {name: one for name, one in names.items() if one.effect not in effects}
            for axis, names in self.axes.items()
        }
        return Held({axis: names for axis, names in remaining.items() if names}, self.source)

    def as_exact(self) -> Held:
        """Return the same values without uncertainty, for what compares fits that all hold them."""
        exact = {
            axis: {name: replace(one, u=(0.0,) * len(one.u)) for name, one in names.items()}
            for axis, names in self.axes.items()
        }
        return Held(exact, self.source)

    def to_json(self) -> HeldJson:
        """Return this as JSON; `u` is null where it is not stated."""
        axes = {axis: {name: _json(one) for name, one in names.items()} for axis, names in self.axes.items()}
        return {"source": self.source, "axes": axes}

    @staticmethod
    def from_json(record: HeldJson | None) -> Held:
        """Return what `to_json` described; nothing is held without a record."""
        if record is None:
            return Held()
        axes = {axis: {name: _read(one) for name, one in names.items()} for axis, names in record["axes"].items()}
        return Held(axes, record["source"])


def _json(coefficient: HeldCoefficient) -> HeldCoefficientJson:
    us = [None if math.isnan(u) else u for u in coefficient.u]
    if coefficient.temperature_c:
        return {
            "effect": coefficient.effect, "value": list(coefficient.value), "u": us, "unit": coefficient.unit,
            "temperature_c": list(coefficient.temperature_c),
        }  # fmt: skip
    return {"effect": coefficient.effect, "value": coefficient.value[0], "u": us[0], "unit": coefficient.unit}


def _read(record: HeldCoefficientJson) -> HeldCoefficient:
    value, u = record["value"], record["u"]
    values = value if isinstance(value, list) else [value]
    us = u if isinstance(u, list) else [u] * len(values)
    return HeldCoefficient(
        tuple(map(float, values)),
        tuple(math.nan if one is None else float(one) for one in us),
        record["unit"],
        record["effect"],
        tuple(map(float, record.get("temperature_c", ()))),
    )
