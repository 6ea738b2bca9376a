"""Elimination of the base from options and data, at one noise.

Everything is done in Gram matrices of whitened coordinates: the base is eliminated once for each noise, and each option
costs a small eigenproblem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from labctl.fitting.criticism.evidence.design import Design, EliminatedBase
from labctl.fitting.criticism.evidence.gains import option_gains
from labctl.fitting.criticism.evidence.noise_grid import DriftModes, Noise, factors, whiten
from labctl.fitting.numeric.arrays import Array


def stack(rows: NDArray[np.float64], scale: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the coordinates besides the means, (rows, k), over their scale (R, m): each present one is a row."""
    kept = present[1:]
    return (rows[1:] / scale[1:, :, None])[kept]


@dataclass(frozen=True)
class NonMeanProducts:
    """Inner products over the coordinates besides the means, which no drift joins: the same for every noise."""

    of_base: NDArray[np.float64]  #: (kb, kb), with the base's prior
    crossed: NDArray[np.float64]  #: (kb, k)
    own: NDArray[np.float64]  #: (k, k)


def non_mean_products(design: Design, rows: NDArray[np.float64], scale: NDArray[np.float64]) -> NonMeanProducts:
    """Return the inner products of the base and of rows (R, m, k), scaled by (R, m)."""
    base, own = stack(design.base, scale, design.present), stack(rows, scale, design.present)
    return NonMeanProducts(base.T @ base + np.diag(design.precision), base.T @ own, own.T @ own)


@dataclass(frozen=True)
class _Remainder:
    """Columns whitened at one noise, with their projection on the base; the last column is the data."""

    whitened: NDArray[np.float64]  #: (m, k) means
    crossed: NDArray[np.float64]  #: (kb, k), to be subtracted as crossed' crossed
    own: NDArray[np.float64]  #: (k, k) inner products of the other coordinates
    log_det: float

    def between(self, columns: slice | NDArray[np.int64], others: slice | int) -> NDArray[np.float64]:
        """Return the inner products of some columns with others, base eliminated."""
        means = self.whitened[:, columns].T @ self.whitened[:, others]
        return np.asarray(means + self.own[columns, others] - self.crossed[:, columns].T @ self.crossed[:, others])

    def within(self, index: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the inner products inside each option (o, w) of columns, as (o, w, w), base eliminated."""
        means, taken = (rows[:, index].transpose(1, 2, 0) for rows in (self.whitened, self.crossed))
        own = self.own[index[:, :, None], index[:, None, :]]
        return np.asarray(means @ means.transpose(0, 2, 1) + own - taken @ taken.transpose(0, 2, 1))

    @property
    def squared_norms(self) -> Array:
        """The squared norms before, (k,)."""
        return np.asarray(np.einsum("mk,mk->k", self.whitened, self.whitened) + np.diag(self.own))


class WhitenedBase:
    """The base of one axis whitened at one noise, ready to be eliminated from other columns."""

    def __init__(self, design: Design, white_var: Array, noise: Noise) -> None:
        self._blocks, log_det = factors(noise, white_var, design.t_s, design.run)
        self._eliminated = _Elimination(noise, whiten(self._blocks, design.base[0]), log_det)

    def eliminate_from(self, means: NDArray[np.float64], others: NonMeanProducts) -> EliminatedBase:
        """Return what remains of means (m, k), the last of which are the data, beside the base."""
        left = self._eliminated.remainder(whiten(self._blocks, means), others)
        gram = left.between(slice(None), slice(None))
        chi2, noise = float(gram[-1, -1]), self._eliminated.noise
        log_p = self._eliminated.log_p(left, chi2)
        return EliminatedBase(noise, log_p, gram[:-1, :-1], left.squared_norms[:-1], gram[:-1, -1], chi2)


@dataclass(frozen=True)
class _Elimination:
    """The whitened means of a base at one noise, and the log determinant of that noise."""

    noise: Noise
    means: NDArray[np.float64]  #: (m, kb)
    log_det: float

    def remainder(self, whitened: NDArray[np.float64], others: NonMeanProducts) -> _Remainder:
        """Return whitened columns (m, k) with their projection on the base."""
        crossed = self.means.T @ whitened + others.crossed
        of_base = self.means.T @ self.means + others.of_base
        log_det = self.log_det
        if len(of_base):
            size = np.sqrt(np.maximum(np.diag(of_base), 1e-300))
            scaled = of_base / np.outer(size, size) + 1e-10 * np.eye(len(size))
            factor = cholesky(scaled, lower=True, check_finite=False)
            crossed = solve_triangular(factor, crossed / size[:, None], lower=True, check_finite=False)
            log_det += 2.0 * float((np.log(np.diag(factor)) + np.log(size)).sum())
        return _Remainder(whitened, crossed, others.own, log_det)

    def log_p(self, left: _Remainder, chi2: float) -> float:
        """Return the restricted log likelihood of the base, with the noise's prior."""
        return -0.5 * (left.log_det + chi2) + self.noise.log_prior


def gains_by_noise(
    design: Design, white_var: Array, means: NDArray[np.float64], others: NonMeanProducts, slices: list[slice],
    noises: Sequence[Noise],
) -> tuple[Array, NDArray[np.float64], NDArray[np.int64]]:  # fmt: skip
    """Return the log likelihood of the base at each noise, (noises,), and of each option, (noises, options), the chi2
    that it removes and the number of its directions; `means` (m, k) are the options' columns and the data.

    The same as from `WhitenedBase`, without the inner products between options, which are most of the work.
    """
    log_p, gain = np.empty(len(noises)), np.empty((len(noises), len(slices)))
    dimensions = np.empty(gain.shape, dtype=np.int64)
    for tau_s in dict.fromkeys(noise.tau_s for noise in noises):
        modes = DriftModes.of(tau_s, white_var, design.t_s, design.run)
        base, columns = modes.amplitudes(design.base[0]), modes.amplitudes(means)
        for i, noise in enumerate(noises):
            if noise.tau_s != tau_s:
                continue
            weights, log_det = modes.weights(noise.size_dps)
            elimination = _Elimination(noise, weights[:, None] * base, log_det)
            left = elimination.remainder(weights[:, None] * columns, others)
            data_products = left.between(slice(None), -1)
            log_p[i] = elimination.log_p(left, float(data_products[-1]))
            gain[i], dimensions[i] = option_gains(slices, left.within, left.squared_norms, data_products)
    return log_p, gain, dimensions


def eliminate_base(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise]
) -> list[EliminatedBase]:
    """Return options and data (R, m) with the base eliminated, for every noise.

    `white_var` (m,) is the white variance of the means in (deg/s)^2, `scale` (R, m) the standard deviation of the other
    coordinates in deg/s.
    """
    everything = np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)
    others = non_mean_products(design, everything, scale)
    return [WhitenedBase(design, white_var, noise).eliminate_from(everything[0], others) for noise in noises]
