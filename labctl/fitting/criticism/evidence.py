"""How much the data speak for each option on one axis: Bayes factors against the base, averaged over the noise.

Everything is done in Gram matrices of whitened coordinates: the base is eliminated once for each noise, and each option
costs a small eigenproblem. Evidence has a unit-information g-prior (g = number of data sets).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from labctl.fitting.criticism.candidates import Option
from labctl.fitting.criticism.noise_grid import Noise, factors, whiten
from labctl.fitting.numeric.arrays import Array

#: Directions of an option that the base leaves less of than this (squared share) are taken as the base's.
LEAST_LEFT = 1e-4


@dataclass(frozen=True)
class Design:
    """One axis before any data: base (R, m, kb) with prior precisions (kb,), and options."""

    base: NDArray[np.float64]
    precision: Array
    options: list[Option]
    present: NDArray[np.bool_]
    t_s: Array
    run: NDArray[np.int64]


@dataclass(frozen=True)
class EliminatedBase:
    """What the base leaves: Gram matrix of all option columns and the data, at one noise."""

    noise: Noise
    log_p: float  #: restricted log likelihood of the base, with the noise's prior
    gram: NDArray[np.float64]  #: (K, K), base eliminated
    whole: Array  #: (K,) squared norms before
    with_data: Array  #: (K,)
    chi2: float


@dataclass(frozen=True)
class AxisEvidence:
    """The evidence on one axis."""

    log_bf: Array  #: (options,), averaged over the noise
    best: EliminatedBase  #: at the noise that the base finds likeliest
    gain: Array  #: (options,) chi2 that each option takes off, at that noise
    dimensions: NDArray[np.int64]  #: (options,) directions that each has beyond the base
    slices: list[slice]
    weights: Array  #: of the noise points
    noises: list[Noise]
    rows: int
    base_columns: int


def stack(rows: NDArray[np.float64], scale: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the coordinates besides the means, (rows, k), scaled: each present coordinate is one row."""
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
class _Left:
    """Rows whitened at one noise, with what the base takes of them; the last column is the data."""

    whitened: NDArray[np.float64]  #: (m, k) means
    crossed: NDArray[np.float64]  #: (kb, k), to be taken off as crossed' crossed
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
    def whole(self) -> Array:
        """The squared norms before, (k,)."""
        return np.asarray(np.einsum("mk,mk->k", self.whitened, self.whitened) + np.diag(self.own))


class Base:
    """The means of one axis' base whitened by one noise, ready to be taken out of anything else."""

    def __init__(self, design: Design, white_var: Array, noise: Noise) -> None:
        self.noise = noise
        self._blocks, self._log_det = factors(noise, white_var, design.t_s, design.run)
        self._means = whiten(self._blocks, design.base[0])

    def _left(self, means: NDArray[np.float64], others: NonMeanProducts) -> _Left:
        whitened = whiten(self._blocks, means)
        crossed = self._means.T @ whitened + others.crossed
        of_base = self._means.T @ self._means + others.of_base
        log_det = self._log_det
        if len(of_base):
            size = np.sqrt(np.maximum(np.diag(of_base), 1e-300))
            scaled = of_base / np.outer(size, size) + 1e-10 * np.eye(len(size))
            factor = cholesky(scaled, lower=True, check_finite=False)
            crossed = solve_triangular(factor, crossed / size[:, None], lower=True, check_finite=False)
            log_det += 2.0 * float((np.log(np.diag(factor)) + np.log(size)).sum())
        return _Left(whitened, crossed, others.own, log_det)

    def taken_out_of(self, means: NDArray[np.float64], others: NonMeanProducts) -> EliminatedBase:
        """Return what is left of means (m, k), the last of which are the data, beside the base."""
        left = self._left(means, others)
        gram = left.between(slice(None), slice(None))
        chi2 = float(gram[-1, -1])
        return EliminatedBase(self.noise, self._log_p(left, chi2), gram[:-1, :-1], left.whole[:-1], gram[:-1, -1], chi2)

    def gains(
        self, means: NDArray[np.float64], others: NonMeanProducts, slices: list[slice]
    ) -> tuple[float, Array, NDArray[np.int64]]:
        """Return the log likelihood, what each option takes off the chi2, and how many directions it has.

        The same as from `taken_out_of`, without the inner products between options, which are most of the work.
        """
        left = self._left(means, others)
        with_data = left.between(slice(None), -1)
        found = _gains(slices, left.within, left.whole, with_data)
        return self._log_p(left, float(with_data[-1])), *found

    def _log_p(self, left: _Left, chi2: float) -> float:
        return -0.5 * (left.log_det + chi2) + self.noise.log_prior


def eliminate_base(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise]
) -> list[EliminatedBase]:
    """Eliminate the base from options and data (R, m), for every noise. `scale` (R, m): of coordinates but the mean."""
    everything = np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)
    others = non_mean_products(design, everything, scale)
    return [Base(design, white_var, noise).taken_out_of(everything[0], others) for noise in noises]


def evidence(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise], rows: int
) -> AxisEvidence:
    """Weigh every option by every noise; `y` (R, m), `white_var` (m,) of the means, `scale` (R, m) of the others."""
    slices = slices_of(design.options)
    everything = np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)
    others = non_mean_products(design, everything, scale)
    bases = (Base(design, white_var, noise) for noise in noises)
    log_ps, gains, dimensions = zip(*(base.gains(everything[0], others, slices) for base in bases), strict=True)
    log_p, gain, k, g = np.array(log_ps), np.array(gains), np.array(dimensions), float(len(design.t_s))
    log_bf = 0.5 * gain * g / (1 + g) - 0.5 * k * np.log1p(g)
    total = logsumexp(log_p[:, None] + log_bf, axis=0) - logsumexp(log_p)
    best = int(np.argmax(log_p))
    return AxisEvidence(
        np.where(k[best] > 0, total, -np.inf),
        Base(design, white_var, noises[best]).taken_out_of(everything[0], others),
        gain[best], k[best], slices, np.exp(log_p - logsumexp(log_p)), noises, rows, design.base.shape[2],
    )  # fmt: skip


def slices_of(options: list[Option]) -> list[slice]:
    """Return where the columns of each option are, side by side."""
    ends = np.cumsum([0, *(option.rows.shape[2] for option in options)])
    return [slice(int(begin), int(end)) for begin, end in pairwise(ends)]


def gains_of(left: EliminatedBase, slices: list[slice]) -> tuple[Array, NDArray[np.int64]]:
    """Return the chi2 that each option takes off and how many directions it has."""
    return _gains(slices, lambda index: left.gram[index[:, :, None], index[:, None, :]], left.whole, left.with_data)


def _gains(
    slices: list[slice], within: Callable[[NDArray[np.int64]], NDArray[np.float64]], whole: Array, with_data: Array
) -> tuple[Array, NDArray[np.int64]]:
    """Solve all options of one width together; `within` gives the inner products inside each of them."""
    gain, dimensions = np.zeros(len(slices)), np.zeros(len(slices), dtype=np.int64)
    size = np.sqrt(np.maximum(whole, 1e-300))
    order = sorted(range(len(slices)), key=lambda i: slices[i].stop - slices[i].start)
    for _, members in groupby(order, key=lambda i: slices[i].stop - slices[i].start):
        which = list(members)
        index = np.array([np.arange(slices[i].start, slices[i].stop) for i in which])
        values, vectors = np.linalg.eigh(within(index) / (size[index][:, :, None] * size[index][:, None, :]))
        inner = np.einsum("oij,oi->oj", vectors, (with_data / size)[index])
        kept = values > LEAST_LEFT
        gain[which] = np.where(kept, inner**2 / np.where(kept, values, 1.0), 0.0).sum(axis=1)
        dimensions[which] = kept.sum(axis=1)
    return gain, dimensions


def solve_option(left: EliminatedBase, where: slice) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients (k,) of an option beside the base, and their covariance (k, k)."""
    size = np.sqrt(np.maximum(left.whole[where], 1e-300))
    values, vectors = np.linalg.eigh(left.gram[where, where] / np.outer(size, size))
    kept = values > LEAST_LEFT
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    coefficients = inverse @ (left.with_data[where] / size) / size
    return coefficients, inverse / np.outer(size, size)


def visible_share(left: EliminatedBase, where: slice) -> float:
    """Return the largest share of an option's columns that the base does not absorb, 0 to 1, in whitened size."""
    shares = np.diag(left.gram)[where] / np.maximum(left.whole[where], 1e-300)
    return float(np.sqrt(np.clip(shares.max(initial=0.0), 0.0, 1.0)))


def reproduced(left: EliminatedBase, signal: slice, by: slice) -> tuple[float, float]:
    """Return (how much of the leader's signal another option reproduces, the signal's size), both in chi2."""
    values, _ = solve_option(left, signal)
    return reproduced_of(left, signal, values, by), float(values @ left.gram[signal, signal] @ values)


def reproduced_of(left: EliminatedBase, signal: slice, values: Array, by: slice) -> float:
    """Return how much of an option's signal with coefficients (k,) another option reproduces, in chi2."""
    inner = left.gram[by, signal] @ values
    scale = np.sqrt(np.maximum(left.whole[by], 1e-300))
    sizes, vectors = np.linalg.eigh(left.gram[by, by] / np.outer(scale, scale))
    kept = sizes > LEAST_LEFT
    return float(((vectors[:, kept].T @ (inner / scale)) ** 2 / sizes[kept]).sum())
