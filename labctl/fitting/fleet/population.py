"""What the calibrated units of a type have in common: mean and spread of each coefficient, groups, and outliers.

A hierarchical model with normal distributions: a unit's coefficient is the mean of the type, plus the shifts of its
groups, plus what the unit differs by, plus the error of its calibration, whose covariance is known. Spreads are those
of the restricted likelihood. What a single unit is believed to be is pulled towards its type by as much as its own
uncertainty exceeds the spread of the type (partial pooling).

Two families of statements are made, each with a probability of 1 % that anything at all is said of a type in which
units differ by nothing but normal scatter: groups, over all levels of all factors and all coefficients, and outliers,
over all units and coefficients (Bonferroni in both).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.fleet.findings import CoefficientPopulation, GroupEffect, GroupSpread, OutlierUnit
from labctl.fitting.fleet.group_effects import DATE
from labctl.fitting.fleet.type_estimate import TypeEstimate, estimate
from labctl.fitting.fleet.unit_coefficients import YEAR, LeftOut, UnitCoefficients, UnitTable, unit_table
from labctl.fitting.numeric.arrays import Array

#: Units without which nothing is said of a type.
MIN_UNITS = 5
#: Share of the variance that keeps a sum of covariances invertible where neither knows of a spread.
TINY = 1e-12


@dataclass(frozen=True)
class PooledUnit:
    """What is believed of a unit by its own calibration and its type together."""

    serial_number: str
    names: tuple[str, ...]
    values: Array  #: (k,)
    covariance: NDArray[np.float64]  #: (k, k)
    weight: Array  #: (k,) share of the unit's own calibration in each coefficient, 0 to 1


@dataclass(frozen=True)
class Population:
    """The units of a type and what they have in common."""

    table: UnitTable
    estimate: TypeEstimate

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the coefficients, (k,)."""
        return self.table.names

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """Units that are no part of it, with the reason."""
        return self.table.left_out

    @property
    def coefficients(self) -> tuple[CoefficientPopulation, ...]:
        """Mean and spread of each coefficient."""
        return self.estimate.coefficients

    @property
    def effects(self) -> tuple[GroupEffect, ...]:
        """Groups that differ from the rest of the type, strongest first."""
        return self.estimate.effects

    @property
    def group_spreads(self) -> tuple[GroupSpread, ...]:
        """How much the levels of each factor differ beside `effects`."""
        return self.estimate.group_spreads

    @property
    def outliers(self) -> tuple[OutlierUnit, ...]:
        """Units that are not like their type, farthest first."""
        return self.estimate.outliers

    @property
    def mean(self) -> Array:
        """Means of the coefficients, (k,)."""
        return np.array([each.mean for each in self.coefficients])

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of the units' true coefficients about the means of their groups, (k, k)."""
        spread = np.array([each.spread for each in self.coefficients])
        return np.asarray(self.estimate.correlation * np.outer(spread, spread))

    def expected(
        self, groups: Mapping[str, str | None], measured_at: datetime | None = None, *, with_bench: bool = True
    ) -> Array:
        """Return the means of a unit of some groups on a date, (k,); `with_bench` as its bench shows it, else as it is.

        Without a date a trend counts at the mean date of the type.
        """
        expected = self.mean.copy()
        for effect in self.effects:
            if effect.is_of_bench and not with_bench:
                continue
            places = [self.names.index(name) for name in effect.coefficients]
            if effect.factor == DATE:
                expected[places] += effect.shift * self._years(measured_at)
            elif groups.get(effect.factor) == effect.level:
                expected[places] += effect.shift
        return expected

    def pooled(self, unit: UnitCoefficients) -> PooledUnit:
        """Return a unit by its own calibration and its type together; its coefficients are those of the type.

        What its bench is known to add to all units is taken off.
        """
        rows = [unit.names.index(name) for name in self.names]
        own = unit.covariance[np.ix_(rows, rows)]
        seen = self.expected(unit.groups, unit.measured_at)
        true = self.expected(unit.groups, unit.measured_at, with_bench=False)
        size = np.sqrt(np.maximum(np.diag(own + self.covariance), 1e-300))
        own_scaled, of_type = own / np.outer(size, size), self.covariance / np.outer(size, size)
        gain = np.linalg.solve(own_scaled + of_type + TINY * np.eye(len(rows)), of_type).T
        left = np.eye(len(rows)) - gain
        covariance = left @ of_type @ left.T + gain @ own_scaled @ gain.T
        return PooledUnit(
            unit.serial_number, self.names, true + size * (gain @ ((unit.values[rows] - seen) / size)),
            covariance * np.outer(size, size), np.asarray(np.clip(np.diag(gain), 0.0, 1.0), dtype=np.float64),
        )  # fmt: skip

    def _years(self, measured_at: datetime | None) -> float:
        mean_date = self.table.mean_date
        return 0.0 if measured_at is None or mean_date is None else (measured_at - mean_date) / YEAR


def population_of(units: Sequence[UnitCoefficients]) -> Population:
    """Return what the units of a type have in common. Raises NotEnoughData with fewer than 5 comparable units."""
    table = unit_table(units)
    if len(table) < MIN_UNITS:
        raise NotEnoughData(
            f"{len(table)} units of the type have the same coefficients; at least {MIN_UNITS} are needed: calibrate "
            "more units of the type with one model"
        )
    return Population(table, estimate(table))
