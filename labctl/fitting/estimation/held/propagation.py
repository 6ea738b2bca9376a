"""Uncertainty of held coefficients in those that are estimated beside them: consider covariance analysis.

Tapley, Schutz and Born 2004, Statistical Orbit Determination, chapter 6. The data y = X f + H c + e are fitted for f
with c held at values of covariance U: f = (X'WX)^-1 X'W (y - H c). An error of c moves f by G = -(X'WX)^-1 X'W H, so
that f has the covariance (X'WX)^-1 + G U G', and f and c the covariance G U in common.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from labctl.fitting.models.held import HeldCoefficient
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Scatter, whitened
from labctl.fitting.numeric.least_squares import Solution
from labctl.fitting.numeric.variance_components import RandomEffects

#: Random effects count with a standard deviation of at least this, in the unit of their coefficients.
LEAST_SPREAD = 1e-9


@dataclass(frozen=True)
class HeldPart:
    """The held coefficients of one axis: h values, for k named coefficients at each temperature node."""

    columns: NDArray[np.float64]  #: (m, h)
    values: Array  #: (h,)
    u: Array  #: (h,) standard uncertainties; NaN: not stated
    spread: NDArray[np.float64]  #: (k * nodes, h): from the values to the coefficients of the table

    @property
    def error_dps(self) -> Array:
        """What they add to the output of the data sets, (m,) deg/s."""
        return np.asarray(self.columns @ self.values)


class HeldColumns:
    """Collects the held part of an axis, coefficient by coefficient; `basis` (m, nodes) is that of the model."""

    def __init__(self, basis: Array) -> None:
        self._basis = basis
        self._columns: list[NDArray[np.float64]] = [np.zeros((len(basis), 0))]
        self._spread: list[NDArray[np.float64]] = []
        self._held: list[HeldCoefficient] = []

    def add(self, known: HeldCoefficient, spread: NDArray[np.float64], values: Array) -> None:
        """Add a held coefficient with its regressor (m,) and its `spread` (nodes, p)."""
        self._columns.append(values[:, None] * (self._basis @ spread))
        self._spread.append(spread)
        self._held.append(known)

    def add_none(self) -> None:
        """Add a coefficient that is estimated."""
        self._spread.append(np.zeros((self._basis.shape[1], 0)))

    @property
    def part(self) -> HeldPart:
        """What was collected."""
        return HeldPart(
            np.concatenate(self._columns, axis=1),
            np.array([value for one in self._held for value in one.value]),
            np.array([u for one in self._held for u in one.u]),
            block_diag(*self._spread) if self._spread else np.zeros((0, 0)),
        )


def with_derivative(
    solution: Solution, held: HeldPart, design: NDArray[np.float64], scatter: Scatter, random: RandomEffects | None
) -> Solution:
    """Return a solution with G, the derivative of its values along the held coefficients.

    `design` (n, k) and `scatter` are those of the solution, with rows for priors below the data sets. The last of these
    are the priors of `random` effects, which count with the standard deviations that were found.
    """
    if held.columns.shape[1] == 0:
        return solution
    below = np.zeros((len(design) - len(held.columns), held.columns.shape[1]))
    white = np.ones(len(design)) if scatter.white_var is None else scatter.white_var.copy()
    if random is not None:
        found = np.array([component.value for component in solution.components])
        white[-len(random.kind) :] = np.maximum(found[random.kind], LEAST_SPREAD) ** 2
    values = np.column_stack([design, np.vstack([held.columns, below])])
    rows = whitened(scatter, [solution.drift], white, values)[0][0]
    k = design.shape[1]
    size = np.maximum(np.linalg.norm(rows[:, :k], axis=0), 1e-300)
    taken, *_ = np.linalg.lstsq(rows[:, :k] / size, rows[:, k:], rcond=1e-12)
    return replace(solution, along_held=-taken / size[:, None])


def joint_covariance(
    solution: Solution, held: HeldPart, spread: NDArray[np.float64]
) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients of the table (k * nodes,) and their covariance, of those estimated and held together.

    `spread` (k * nodes, c) is that of the c estimated columns. A held coefficient without uncertainty has NaN in its
    rows and columns; the others are then as certain as if it were exact.
    """
    c = spread.shape[1]
    values = spread @ solution.values[:c] + held.spread @ held.values
    covariance = spread @ solution.covariance[:c, :c] @ spread.T
    if solution.along_held is None:
        return values, covariance
    root = (spread @ solution.along_held[:c] + held.spread) * np.nan_to_num(held.u)
    covariance = covariance + root @ root.T
    unknown = np.any(held.spread[:, np.isnan(held.u)] != 0, axis=1)
    covariance[unknown, :] = covariance[:, unknown] = np.nan
    return values, covariance
