"""How much the data speak for each option on one axis: Bayes factors against the base, averaged over the noise.

Everything is done in Gram matrices of whitened coordinates: the base is eliminated once for each noise, and each option
costs a small eigenproblem. Evidence has a unit-information g-prior (g = number of data sets).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from labctl.fitting.channels import Array
from labctl.fitting.criticism.candidates import Option
from labctl.fitting.criticism.noise_grid import Noise, factors

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
class Schur:
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
    best: Schur  #: at the noise that the base finds likeliest
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
class Others:
    """Inner products over the coordinates besides the means, which no drift joins: the same for every noise."""

    of_base: NDArray[np.float64]  #: (kb, kb), with the base's prior
    crossed: NDArray[np.float64]  #: (kb, k)
    own: NDArray[np.float64]  #: (k, k)


def others_of(design: Design, rows: NDArray[np.float64], scale: NDArray[np.float64]) -> Others:
    """Return the inner products of the base and of rows (R, m, k), scaled by (R, m)."""
    base, own = stack(design.base, scale, design.present), stack(rows, scale, design.present)
    return Others(base.T @ base + np.diag(design.precision), base.T @ own, own.T @ own)


class Base:
    """The means of one axis' base whitened by one noise, ready to be taken out of anything else."""

    def __init__(self, design: Design, white_var: Array, noise: Noise) -> None:
        self.noise = noise
        self._blocks, self._log_det = factors(noise, white_var, design.t_s, design.run)
        self._means = self._whitened(design.base[0])

    def _whitened(self, means: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.empty_like(means)
        for which, factor in self._blocks:
            found[which] = solve_triangular(factor, means[which], lower=True, check_finite=False)
        return found

    def taken_out_of(self, means: NDArray[np.float64], others: Others) -> Schur:
        """Return what is left of means (m, k), the last of which are the data, beside the base."""
        whitened = self._whitened(means)
        gram, crossed = whitened.T @ whitened + others.own, self._means.T @ whitened + others.crossed
        of_base = self._means.T @ self._means + others.of_base
        size = np.sqrt(np.maximum(np.diag(of_base), 1e-300))
        kb, log_det = len(size), self._log_det
        left = gram
        if kb:
            scaled = of_base / np.outer(size, size) + 1e-10 * np.eye(kb)
            factor = cholesky(scaled, lower=True, check_finite=False)
            crossed = solve_triangular(factor, crossed / size[:, None], lower=True, check_finite=False)
            left = gram - crossed.T @ crossed
            log_det += 2.0 * float((np.log(np.diag(factor)) + np.log(size)).sum())
        chi2 = float(left[-1, -1])
        log_p = -0.5 * (log_det + chi2) + self.noise.log_prior
        return Schur(self.noise, log_p, left[:-1, :-1], np.diag(gram)[:-1], left[:-1, -1], chi2)


def schur(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise]
) -> list[Schur]:
    """Eliminate the base from options and data (R, m), for every noise. `scale` (R, m): of coordinates but the mean."""
    everything = np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)
    others = others_of(design, everything, scale)
    return [Base(design, white_var, noise).taken_out_of(everything[0], others) for noise in noises]


def evidence(design: Design, found: list[Schur], rows: int) -> AxisEvidence:
    """Weigh every option by every noise."""
    slices, at = [], 0
    for option in design.options:
        k = option.rows.shape[2]
        slices.append(slice(at, at + k))
        at += k
    g = float(len(design.t_s))
    log_p = np.array([s.log_p for s in found])
    gains, dimensions = zip(*(gains_of(s, slices) for s in found), strict=True)
    gain, k = np.array(gains), np.array(dimensions)
    log_bf = 0.5 * gain * g / (1 + g) - 0.5 * k * np.log1p(g)
    total = logsumexp(log_p[:, None] + log_bf, axis=0) - logsumexp(log_p)
    best = int(np.argmax(log_p))
    weights = np.exp(log_p - logsumexp(log_p))
    return AxisEvidence(
        np.where(k[best] > 0, total, -np.inf), found[best], gain[best], k[best], slices, weights,
        [s.noise for s in found], rows, design.base.shape[2],
    )  # fmt: skip


def gains_of(left: Schur, slices: list[slice]) -> tuple[Array, NDArray[np.int64]]:
    """Return the chi2 that each option takes off and how many directions it has, all of one width together."""
    gain, dimensions = np.zeros(len(slices)), np.zeros(len(slices), dtype=np.int64)
    size = np.sqrt(np.maximum(left.whole, 1e-300))
    gram, data = left.gram / np.outer(size, size), left.with_data / size
    order = sorted(range(len(slices)), key=lambda i: slices[i].stop - slices[i].start)
    for width, members in groupby(order, key=lambda i: slices[i].stop - slices[i].start):
        which = list(members)
        index = np.array([np.arange(slices[i].start, slices[i].stop) for i in which])
        values, vectors = np.linalg.eigh(gram[index[:, :, None], index[:, None, :]])
        inner = np.einsum("oij,oi->oj", vectors, data[index])
        kept = values > LEAST_LEFT
        gain[which] = np.where(kept, inner**2 / np.where(kept, values, 1.0), 0.0).sum(axis=1)
        dimensions[which] = kept.sum(axis=1)
        del width
    return gain, dimensions


def solve_option(left: Schur, where: slice) -> tuple[Array, NDArray[np.float64]]:
    """Return the coefficients (k,) of an option beside the base, and their covariance (k, k)."""
    size = np.sqrt(np.maximum(left.whole[where], 1e-300))
    values, vectors = np.linalg.eigh(left.gram[where, where] / np.outer(size, size))
    kept = values > LEAST_LEFT
    inverse = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    coefficients = inverse @ (left.with_data[where] / size) / size
    return coefficients, inverse / np.outer(size, size)


def visible_share(left: Schur, where: slice) -> float:
    """Return the largest share of an option's columns that the base does not absorb, 0 to 1, in whitened size."""
    shares = np.diag(left.gram)[where] / np.maximum(left.whole[where], 1e-300)
    return float(np.sqrt(np.clip(shares.max(initial=0.0), 0.0, 1.0)))


def reproduced(left: Schur, signal: slice, by: slice) -> tuple[float, float]:
    """Return (how much of the leader's signal another option reproduces, the signal's size), both in chi2."""
    values, _ = solve_option(left, signal)
    return reproduced_of(left, signal, values, by), float(values @ left.gram[signal, signal] @ values)


def reproduced_of(left: Schur, signal: slice, values: Array, by: slice) -> float:
    """Return how much of an option's signal with coefficients (k,) another option reproduces, in chi2."""
    inner = left.gram[by, signal] @ values
    scale = np.sqrt(np.maximum(left.whole[by], 1e-300))
    sizes, vectors = np.linalg.eigh(left.gram[by, by] / np.outer(scale, scale))
    kept = sizes > LEAST_LEFT
    return float(((vectors[:, kept].T @ (inner / scale)) ** 2 / sizes[kept]).sum())
