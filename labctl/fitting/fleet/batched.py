"""Generalised least squares of many units at once, by the noise that is stated for all of them.

Units that were measured at the same rates and temperatures have the same design: one QR serves all, and their means
are columns beside each other. A law of the output has a design of its own for each unit: then the triangles are made
in batches. Both give what `least_squares.solve` gives with that noise, to rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift, Scatter
from labctl.fitting.numeric.drift_whitening import whitened
from labctl.fitting.numeric.least_squares import rank_of

#: Numbers of an array that are in work at a time: memory does not grow with the units.
CHUNK = 4_000_000
#: Triangles with a smaller diagonal than this, over the largest of scaled columns, determine no coefficients.
SINGULAR = 1e-9


@dataclass(frozen=True)
class BatchedFit:
    """Coefficients of n units, with what is needed for their covariance."""

    values: NDArray[np.float64]  #: (n, k)
    inverse: NDArray[np.float64]  #: (k, k), or (n, k, k) where each unit has its design: roots of the covariance
    scale: Array  #: (n,) factor on the covariance by the residuals; 1 where they are no larger than the stated noise
    chi2: Array  #: (n,) of the whitened residuals

    def __len__(self) -> int:
        return len(self.values)

    @property
    def u(self) -> NDArray[np.float64]:
        """Standard uncertainties, (n, k)."""
        root = np.sqrt(np.sum(self.inverse**2, axis=-1))
        return np.asarray(np.sqrt(self.scale)[:, None] * root)

    def covariance(self, unit: int) -> NDArray[np.float64]:
        """Return the covariance of the coefficients of one unit, (k, k)."""
        root = self.inverse if self.inverse.ndim == 2 else self.inverse[unit]
        return np.asarray(self.scale[unit] * root @ root.T)


def batched_fit(design: NDArray[np.float64], y: NDArray[np.float64], scatter: Scatter, drift: Drift) -> BatchedFit:
    """Fit y (m, n), the means of n units, by one design (m, k), with the noise of `scatter` and `drift`.

    Raises NotEnoughData where the design does not determine its coefficients.
    """
    m, k = design.shape
    if m < k or rank_of(design) < k:
        raise NotEnoughData(
            f"{m} data sets determine only {min(m, rank_of(design))} of the {k} coefficients of the model; measure at "
            "other rates and temperatures, or leave effects out"
        )
    white = _white(scatter, m)
    q, r = np.linalg.qr(whitened(scatter, [drift], white, design)[0][0])
    values, chi2 = np.empty((y.shape[1], k)), np.empty(y.shape[1])
    step = max(CHUNK // m, 1)
    for begin in range(0, y.shape[1], step):
        part = slice(begin, begin + step)
        rows = whitened(scatter, [drift], white, np.ascontiguousarray(y[:, part]))[0][0]
        projected = q.T @ rows
        values[part] = solve_triangular(r, projected, check_finite=False).T
        rows -= q @ projected
        chi2[part] = np.einsum("mn,mn->n", rows, rows)
    inverse = np.asarray(solve_triangular(r, np.eye(k), check_finite=False))
    return BatchedFit(values, inverse, _scale(chi2, m - k, scatter), chi2)


def batched_fit_of_each(
    design: NDArray[np.float64], y: NDArray[np.float64], scatter: Scatter, drift: Drift
) -> BatchedFit:
    """Fit y (n, m) of n units by a design of each (n, m, k); units that it does not determine have NaN."""
    n, m, k = design.shape
    white = _white(scatter, m)
    values, chi2, inverse = np.empty((n, k)), np.empty(n), np.empty((n, k, k))
    for part in chunks(n, m * (k + 1)):
        rows = np.concatenate([design[part], y[part, :, None]], axis=2).transpose(1, 0, 2)
        flat = whitened(scatter, [drift], white, rows.reshape(m, -1))[0][0]
        triangles: NDArray[np.float64] = np.asarray(
            np.linalg.qr(flat.reshape(m, -1, k + 1).transpose(1, 0, 2), mode="r"), dtype=np.float64
        )
        size = np.sqrt(np.sum(triangles[:, :, :k] ** 2, axis=1))
        diagonal = np.abs(np.diagonal(triangles, axis1=1, axis2=2))[:, :k] / np.maximum(size, 1e-300)
        lost = diagonal.min(axis=1) < SINGULAR
        r = np.where(lost[:, None, None], np.eye(k), triangles[:, :k, :k])
        inverse[part] = np.where(lost[:, None, None], np.nan, _inverses(r))
        values[part] = np.einsum("nij,nj->ni", inverse[part], triangles[:, :k, k])
        chi2[part] = np.sum(triangles[:, k:, k] ** 2, axis=1)
    return BatchedFit(values, inverse, _scale(chi2, m - k, scatter), chi2)


def chunks(n: int, each: int) -> Iterator[slice]:
    """Yield slices of n units of `each` numbers that are in work together."""
    step = max(CHUNK // max(each, 1), 1)
    for begin in range(0, n, step):
        yield slice(begin, min(begin + step, n))


def _inverses(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverses of upper triangles (n, k, k), by back substitution for all units together."""
    k = triangles.shape[1]
    inverse = np.zeros_like(triangles)
    for row in range(k - 1, -1, -1):
        right = -np.einsum("nj,njc->nc", triangles[:, row, row + 1 :], inverse[:, row + 1 :])
        right[:, row] += 1.0
        inverse[:, row] = right / triangles[:, row, row, None]
    return inverse


def _white(scatter: Scatter, m: int) -> Array:
    return np.ones(m) if scatter.white_var is None else scatter.white_var


def _scale(chi2: Array, freedom: int, scatter: Scatter) -> Array:
    """Return the factor on the covariance as `least_squares` has it."""
    if scatter.white_var is None:
        return np.asarray(np.maximum(chi2, 1e-300) / max(freedom, 1)) if freedom > 0 else np.full(len(chi2), np.nan)
    return np.asarray(np.maximum(chi2 / max(freedom, 1), 1.0))
