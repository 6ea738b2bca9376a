"""Elimination of the base from options and data, at one noise.

Everything is done in Gram matrices of whitened coordinates: the base is eliminated once for each noise, and each option
costs a small eigenproblem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.design import Design, EliminatedBase
from labctl.fitting.criticism.evidence.drawn_shifts import DrawnShifts
from labctl.fitting.criticism.evidence.gains import OptionPairs
from labctl.fitting.criticism.evidence.noise_grid import DriftModes, Noise, factors, whiten
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.triangular import lower_factor, solve_lower


def stack(rows: NDArray[np.float64], scale: NDArray[np.float64], present: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the coordinates besides the means, (rows, k), over their scale (R, m): each present one is a row."""
    present_after = present[1:]
    stacked = rows[1:][present_after]
    stacked /= scale[1:][present_after][:, None]  # in place: the arrays are large, and a second one costs as much again
    return stacked


@dataclass(frozen=True)
class NonMeanProducts:
    """Inner products over the coordinates besides the means, which no drift joins: the same for every noise."""

    of_base: NDArray[np.float64]  #: (kb, kb), with the base's prior
    crossed: NDArray[np.float64]  #: (kb, k)
    of_rows: NDArray[np.float64]  #: (k, k)


class ScaledBase:
    """The base of one axis in the coordinates besides the means, over their scale (R, m)."""

    def __init__(self, design: Design, scale: NDArray[np.float64]) -> None:
        self._present, self._scale = design.present, scale
        self._columns = stack(design.base, scale, design.present)
        self._of_base = self._columns.T @ self._columns + np.diag(design.precision)

    def products(self, rows: NDArray[np.float64]) -> NonMeanProducts:
        """Return the inner products of the base and of rows (R, m, k)."""
        columns = stack(rows, self._scale, self._present)
        return NonMeanProducts(self._of_base, self._columns.T @ columns, columns.T @ columns)


@dataclass(frozen=True)
class MeanProducts:
    """Inner products of whitened means at one noise: of the base, the options within themselves, and the data."""

    noise: Noise
    log_det: float
    of_base: NDArray[np.float64]  #: (kb, kb)
    crossed: NDArray[np.float64]  #: (kb, k), the last column with the data
    pairs: Array  #: (p,) of the columns that belong to one option
    with_data: Array  #: (k,), the last the data's own


@dataclass(frozen=True)
class MeansByNoise:
    """Inner products of the means at every noise: most of the work of the evidence, whatever the other coordinates."""

    white_var: Array  #: (m,) white variance of the means, (deg/s)^2
    noises: list[Noise]
    slices: list[slice]  #: the place of each option's columns
    options: OptionPairs
    products: list[MeanProducts]

    @staticmethod
    def of(
        design: Design, means: NDArray[np.float64], slices: list[slice], white_var: Array, noises: list[Noise]
    ) -> MeansByNoise:
        """Return the products of `means` (m, k), the options' columns and the data, at each noise."""
        options = OptionPairs.of(slices)
        products: dict[Noise, MeanProducts] = {}
        for tau_s in dict.fromkeys(noise.tau_s for noise in noises):
            modes = DriftModes.of(tau_s, white_var, design.t_s, design.run)
            of_tau = [noise for noise in noises if noise.tau_s == tau_s]
            base, columns = modes.amplitudes(design.base[0]), modes.amplitudes(means)
            weights, log_dets = zip(*(modes.weights(noise.size_dps) for noise in of_tau), strict=True)
            shares = np.array(weights) ** 2
            products_of_pairs = columns.take(options.left, axis=1)
            products_of_pairs *= columns.take(options.right, axis=1)
            pairs = shares @ products_of_pairs
            with_data = shares @ (columns * columns[:, -1:])
            for k, noise in enumerate(of_tau):
                weighted = shares[k][:, None] * base
                products[noise] = MeanProducts(
                    noise, log_dets[k], weighted.T @ base, weighted.T @ columns, pairs[k], with_data[k]
                )
        return MeansByNoise(white_var, noises, slices, options, [products[noise] for noise in noises])


@dataclass(frozen=True)
class GainsByNoise:
    """What options remove at each noise."""

    log_p: Array  #: (noises,) log likelihood of the base
    gain: NDArray[np.float64]  #: (noises, options) chi2 that each removes
    dimensions: NDArray[np.int64]  #: (noises, options) directions of each
    log_bf: NDArray[np.float64]  #: (noises, options) log Bayes factor against the base


def gains_by_noise(
    means: MeansByNoise, other_products: NonMeanProducts, g: float, drawn: Sequence[int] = ()
) -> GainsByNoise:
    """Return what the options remove at each noise, and their evidence with a unit-information prior of `g` data sets.

    `drawn` are the numbers of the options whose coefficients are draws. The same as from `WhitenedBase`, without the
    inner products between options, which are most of the work.
    """
    left, right = means.options.left, means.options.right
    own_pairs, own_with_data = other_products.of_rows[left, right], other_products.of_rows[:, -1]
    single = means.options.single
    log_p, gain = np.empty(len(means.noises)), np.empty((len(means.noises), len(means.slices)))
    dimensions = np.empty(gain.shape, dtype=np.int64)
    of_draws = np.empty((len(means.noises), len(drawn)))
    for i, at in enumerate(means.products):
        crossed, log_det = _projected(at.of_base + other_products.of_base, at.crossed + other_products.crossed)
        data_products = at.with_data + own_with_data - crossed.T @ crossed[:, -1]
        log_p[i] = _log_p(at.noise, at.log_det + log_det, float(data_products[-1]))
        before = at.pairs + own_pairs
        after = before - np.einsum("kp,kp->p", crossed[:, left], crossed[:, right])
        gain[i], dimensions[i] = means.options.gains(after, before[single], data_products)
        for j, option in enumerate(drawn):
            place = means.slices[option]
            of_draws[i, j] = DrawnShifts.of(means.options.block(after, place), g).log_bf(data_products[place])
    log_bf = 0.5 * gain * g / (1 + g) - 0.5 * dimensions * np.log1p(g)
    log_bf[:, list(drawn)] = of_draws
    return GainsByNoise(log_p, gain, dimensions, log_bf)


def _projected(of_base: NDArray[np.float64], crossed: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return columns' inner products with a base, (kb, k), as projections on it, and its log determinant."""
    if not len(of_base):
        return crossed, 0.0
    size = np.sqrt(np.maximum(np.diag(of_base), 1e-300))
    scaled = of_base / (size[:, None] * size)
    scaled[np.diag_indices(len(size))] += 1e-10
    factor = lower_factor(scaled)
    projected = solve_lower(factor, crossed / size[:, None])
    return projected, 2.0 * float((np.log(np.diag(factor)) + np.log(size)).sum())


def _log_p(noise: Noise, log_det: float, chi2: float) -> float:
    """Return the restricted log likelihood of the base, with the noise's prior."""
    return -0.5 * (log_det + chi2) + noise.log_prior


class WhitenedBase:
    """The base of one axis whitened at one noise, ready to be eliminated from other columns."""

    def __init__(self, design: Design, white_var: Array, noise: Noise) -> None:
        self._noise = noise
        self._blocks, self._log_det = factors(noise, white_var, design.t_s, design.run)
        self._means = whiten(self._blocks, design.base[0])

    def eliminate_from(self, means: NDArray[np.float64], other_products: NonMeanProducts) -> EliminatedBase:
        """Return what remains of means (m, k), the last of which are the data, beside the base."""
        whitened = whiten(self._blocks, means)
        of_base, crossed = (
            self._means.T @ self._means + other_products.of_base,
            self._means.T @ whitened + other_products.crossed,
        )
        crossed, log_det = _projected(of_base, crossed)
        before = whitened.T @ whitened + other_products.of_rows
        gram = before - crossed.T @ crossed
        chi2 = float(gram[-1, -1])
        return EliminatedBase(
            self._noise, _log_p(self._noise, self._log_det + log_det, chi2), gram[:-1, :-1], np.diag(before)[:-1],
            gram[:-1, -1], chi2,
        )  # fmt: skip


def eliminate_base(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise]
) -> list[EliminatedBase]:
    """Return options and data (R, m) with the base eliminated, for every noise.

    `white_var` (m,) is the white variance of the means in (deg/s)^2, `scale` (R, m) the standard deviation of the other
    coordinates in deg/s.
    """
    everything = np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)
    others = ScaledBase(design, scale).products(everything)
    return [WhitenedBase(design, white_var, noise).eliminate_from(everything[0], others) for noise in noises]
