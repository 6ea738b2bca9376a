"""Uncertainty of held coefficients in those that are estimated beside them: consider covariance analysis.

Tapley, Schutz and Born 2004, Statistical Orbit Determination, chapter 6. The data y = X f + H c + e are fitted for f
with c held at values of covariance U: f = (X'WX)^-1 X'W (y - H c). An error of c moves f by G = -(X'WX)^-1 X'W H, so
that f has the covariance (X'WX)^-1 + G U G', and f and c the covariance G U in common.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from labctl.fitting.data.earth import with_prior
from labctl.fitting.models.held import HeldCoefficient
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Scatter
from labctl.fitting.numeric.least_squares import Considered, Solution, rank_of

#: The standard deviation, deg/s, that the row of a prior has in scaled columns: a drift adds nothing to that.
PRIOR = 1e3


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


def considered(
    held: HeldPart, columns: NDArray[np.float64], y: Array, scatter: Scatter
) -> tuple[NDArray[np.float64], Array, Scatter, Considered | None]:
    """Return design (n, k), y and scatter of the estimated columns, and what is known beside them; None: nothing.

    What an error of a held coefficient leaves in the data is no noise, so the noise is estimated beside it: with its
    uncertainty as a prior, a row for each; or freely, where the white noise, and so the weight of that row, is unknown.
    A coefficient without uncertainty is taken as exact, and what it leaves counts as noise.
    """
    if held.columns.shape[1] == 0:
        return columns, y, scatter, None
    has_u = (np.nan_to_num(held.u) > 0) & np.any(held.columns, axis=0)
    uncertain = held.columns[:, has_u] * held.u[has_u] / PRIOR
    k = columns.shape[1]
    if scatter.white_var is not None:
        whole, y, scatter = with_prior(columns, uncertain, y, scatter, np.full(uncertain.shape[1], PRIOR**2))
        columns, beside = whole[:, :k], whole[:, k:]
    else:
        beside = _determined(columns, uncertain)
    below = np.zeros((len(columns) - len(held.columns), held.columns.shape[1]))
    return columns, y, scatter, Considered(np.vstack([held.columns, below]), beside)


def _determined(columns: NDArray[np.float64], more: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those of more columns (m, b) that the data determine beside columns (m, k), with a row to spare."""
    kept = np.zeros((len(columns), 0))
    for column in more.T:
        tried = np.column_stack([kept, column])
        whole = np.column_stack([columns, tried])
        if len(whole) > whole.shape[1] and rank_of(whole) == whole.shape[1]:
            kept = tried
    return kept


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
    h = held.columns.shape[1]
    if solution.along_held is None or h == 0:
        return values, covariance
    root = (spread @ solution.along_held[:c, :h] + held.spread) * np.nan_to_num(held.u)
    covariance = covariance + root @ root.T
    unknown = np.any(held.spread[:, np.isnan(held.u)] != 0, axis=1)
    covariance[unknown, :] = covariance[:, unknown] = np.nan
    return values, covariance
