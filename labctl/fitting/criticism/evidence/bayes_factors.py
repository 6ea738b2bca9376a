"""Bayes factors of the options on one axis against the base, averaged over the noise.

The evidence has a unit-information g-prior on the coefficients (g = number of data sets); where these are draws, one
for each powered run or mounting, it is averaged over the standard deviation of the draws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape, slices_of
from labctl.fitting.criticism.evidence.design import Design, EliminatedBase
from labctl.fitting.criticism.evidence.drawn_shifts import size_average_nats
from labctl.fitting.criticism.evidence.elimination import MeansByNoise, ScaledBase, WhitenedBase, gains_by_noise
from labctl.fitting.criticism.evidence.gains import visible_share
from labctl.fitting.criticism.evidence.noise_grid import Noise
from labctl.fitting.effects import kind_of
from labctl.fitting.numeric.arrays import Array

#: An option that follows another channel than those of the base (rate and temperature) does not compete where the base
#: leaves less than this share of it: no shape is known so exactly that the rest would be evidence.
MIN_COMPETING = 0.1
OF_BASE = frozenset({"temperature_c", "table_rate_dps"})


@dataclass(frozen=True)
class AxisEvidence:
    """Evidence for the options on one axis."""

    log_bf: Array  #: (options,) log Bayes factor against the base, averaged over the noise
    size_nats: Array  #: (options,) what that gains where the size is averaged over as that of draws is
    best: EliminatedBase  #: at the noise that the base finds likeliest
    gain: Array  #: (options,) chi2 that each option removes, at that noise
    dimensions: NDArray[np.int64]  #: (options,) directions that each has beside the base
    slices: list[slice]  #: the place of each option's columns
    weights: Array  #: (noises,) posterior probability of each noise
    noises: list[Noise]
    rows: int  #: number of coordinates
    base_columns: int  #: without a prior
    log_p: float  #: restricted log likelihood of the base, averaged over the noise, its priors normalised


def means_by_noise(design: Design, y: NDArray[np.float64], white_var: Array, noises: list[Noise]) -> MeansByNoise:
    """Return the inner products of the means at every noise; `white_var` (m,) is their white variance, (deg/s)^2."""
    means = np.concatenate([*(option.rows[0] for option in design.options), y[0][:, None]], axis=1)
    return MeansByNoise.of(design, means, slices_of(design.options), white_var, noises)


def evidence_of(
    design: Design, y: NDArray[np.float64], white_var: Array, scale: NDArray[np.float64], noises: list[Noise]
) -> AxisEvidence:
    """Return the evidence for every option where nothing is weighed before it; parameters as of `evidence`."""
    return evidence(design, y, means_by_noise(design, y, white_var, noises), scale, int(design.present.sum()))


def _with_data(design: Design, y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the columns of all options and the data as the last, (R, m, k)."""
    return np.concatenate([*(o.rows for o in design.options), y[:, :, None]], axis=2)


def evidence(
    design: Design, y: NDArray[np.float64], means: MeansByNoise, scale: NDArray[np.float64], rows: int
) -> AxisEvidence:
    """Return the evidence for every option, averaged over the noises.

    `y` (R, m) deg/s are the data, `means` the products of their means, `scale` (R, m) the standard deviation of the
    other coordinates in deg/s, `rows` the number of coordinates that exist.
    """
    slices, noises = means.slices, means.noises
    everything = _with_data(design, y)
    others = ScaledBase(design, scale).products(everything)
    drawn = [i for i, option in enumerate(design.options) if option.is_drawn]
    g = float(len(design.t_s))
    found = gains_by_noise(means, others, g, drawn)
    log_p = found.log_p
    log_all = float(np.logaddexp.reduce(log_p))
    total = np.logaddexp.reduce(log_p[:, None] + found.log_bf, axis=0) - log_all
    best = int(np.argmax(log_p))
    eliminated = WhitenedBase(design, means.white_var, noises[best]).eliminate_from(everything[0], others)
    competes = [
        _is_of_base(option) or visible_share(eliminated, option_rows) >= MIN_COMPETING
        for option, option_rows in zip(design.options, slices, strict=True)
    ]
    size_nats = size_average_nats(found.gain[best], found.dimensions[best], g)
    size_nats[drawn] = 0.0
    return AxisEvidence(
        np.where((found.dimensions[best] > 0) & np.array(competes, dtype=bool), total, -np.inf), size_nats,
        eliminated,
        found.gain[best], found.dimensions[best], slices, np.exp(log_p - log_all), noises, rows,
        int((design.precision == 0).sum()),
        float(log_all + 0.5 * np.log(design.precision[design.precision > 0]).sum()),
    )  # fmt: skip


def _is_of_base(option: CandidateShape) -> bool:
    """Return whether an option is a law of rate and temperature alone."""
    if option.term is None:
        return option.candidate in OF_BASE
    return not kind_of(option.term).needs
