"""What is known of coefficients before a fit, from other units of the type: as rows of the fit.

A prior is a measurement like any other: the coefficients are its mean, up to its covariance. Fewer data sets then leave
the same uncertainty. A unit that is not like its type contradicts the prior (`labctl.fitting.fleet.prior`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import Reference
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import Preset, Rows
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array

#: Share of a variance that keeps a covariance invertible.
TINY = 1e-10


@dataclass(frozen=True)
class CoefficientPrior:
    """Expected value and covariance of the k coefficients of a unit before it is measured."""

    names: tuple[str, ...]  #: (k,) as `coefficient_names` has them
    mean: Array  #: (k,)
    covariance: NDArray[np.float64]  #: (k, k)
    units: int  #: of the type that it is from
    reference_temperature_c: float | None = None  #: that they hold for; None: it has no part in them

    def of(self, names: Sequence[str]) -> CoefficientPrior:
        """Return the prior of those coefficients among `names` that it knows, in their order."""
        places = [self.names.index(name) for name in names if name in self.names]
        known = tuple(self.names[i] for i in places)
        return replace(self, names=known, mean=self.mean[places], covariance=self.covariance[np.ix_(places, places)])

    def known(self, axis: str) -> frozenset[str]:
        """Return the names of the coefficients of an axis that it knows, without axis and temperature."""
        return frozenset(name.split(".", 1)[1].split("@")[0] for name in self.names if name.startswith(f"{axis}."))

    def referred(self, model: ErrorModel) -> ErrorModel:
        """Return a model with the reference temperature that the prior holds for."""
        if self.reference_temperature_c is None:
            return model
        return replace(model, reference=Reference(self.reference_temperature_c))

    def whitened(self, spread: NDArray[np.float64], names: Sequence[str]) -> tuple[NDArray[np.float64], Array]:
        """Return rows (q, c) and their values (q,), of noise 1, of c columns from which `spread` makes coefficients.

        `spread` (k, c) leads from the estimated columns to the coefficients `names` (k,).
        """
        own = self.of(names)
        if not own.names:
            return np.zeros((0, spread.shape[1])), np.zeros(0)
        size = np.sqrt(np.maximum(np.diag(own.covariance), 1e-300))
        scaled = own.covariance / np.outer(size, size) + TINY * np.eye(len(size))
        factor = np.linalg.cholesky(scaled)
        chosen = spread[[list(names).index(name) for name in own.names]]
        rows = solve_triangular(factor, np.column_stack([chosen, own.mean]) / size[:, None], lower=True)
        return rows[:, :-1], rows[:, -1]


def with_reference(preset: Preset, prior: CoefficientPrior) -> Preset:
    """Return a preset whose models have the reference temperature that a prior holds for."""

    def build(data: FitData) -> tuple[ErrorModel, Rows]:
        model, rows = preset.build(data)
        return prior.referred(model), rows

    return replace(preset, build=build)


def coefficient_names(model: ErrorModel, axis: str, owners: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return a name for each coefficient of an axis at each node of the temperature table, the nodes fastest.

    `axis.name`; of a table `axis.name@temperature`, in whole deg C where these differ, since the levels of two units
    are never exactly the same; "" for all but the first node of an effect that has one coefficient for all
    temperatures. `owners` are the effects of the coefficients.
    """
    nodes = model.temperature.nodes_c if isinstance(model.temperature, LagrangeTable) else ()
    places = [f"@{round(node)}" for node in nodes]
    if len(set(places)) < len(places):
        places = [f"@{node:.1f}" for node in nodes]
    listed = []
    for owner, name in zip(owners, names, strict=True):
        if owner in model.steady or not places:
            listed += [f"{axis}.{name}", *([""] * (len(places) - 1))]
        else:
            listed += [f"{axis}.{name}{place}" for place in places]
    return listed
