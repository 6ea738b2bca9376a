"""Evidence for each shape of an effect over the units of a type, against nothing, by marginal likelihoods.

The estimates of all units are normally distributed about what an effect of some sizes gives. With the sizes integrated
out, what they differ by adds to the scatter in the directions of the shape alone, while noise that is larger than
stated adds to the scatter in all directions. So a large effect whose size is each unit's own is not taken for noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.fitting.fleet.type_sums import AxisSums
from labctl.fitting.numeric.arrays import Array

#: A direction that is left with less than this share beside what was found is taken as found.
MIN_REMAINING = 1e-4


@dataclass(frozen=True)
class ShapeEvidence:
    """Log Bayes factors of the shapes of one axis, nats, (S,) each."""

    common: Array
    about_zero: Array  #: sizes that differ from unit to unit, about 0
    about_mean: Array  #: and about a mean
    gain: Array  #: chi2 that a common size takes off
    noise: Array  #: by which the noise of a unit is larger than stated, at least 1, beside the likeliest of these

    @property
    def log_bf(self) -> Array:
        """Averaged over both."""
        varied = np.logaddexp(self.about_zero, self.about_mean) - np.log(2.0)
        return np.asarray(np.logaddexp(self.common, varied) - np.log(2.0))


def common_size(sums: AxisSums, shape: int) -> tuple[Array, float, int]:
    """Return the common size of a shape (k,), the chi2 that it takes off, and its directions."""
    own = sums.slice_of(shape)
    block, product = sums.information[own, own], sums.products[own]
    size = np.sqrt(np.maximum(np.diag(block), 1e-300))
    values, vectors = np.linalg.eigh(block / np.outer(size, size))
    kept = values > MIN_REMAINING
    inner = vectors[:, kept].T @ (product / size)
    return vectors[:, kept] @ (inner / values[kept]) / size, float(np.sum(inner**2 / values[kept])), int(kept.sum())


def noise_scale(chi2: Array | float, freedom: Array | float) -> Array:
    """Return the variance of estimates over that which they state, at least 1."""
    return np.asarray(np.maximum(np.maximum(chi2, 0.0) / np.maximum(freedom, 1.0), 1.0))


def _log_likelihood(chi2: Array | float, freedom: Array | float, scale: Array) -> Array:
    """Return the log likelihood of normal values with a variance, nats, but for a constant."""
    return np.asarray(-0.5 * (freedom * np.log(scale) + chi2 / scale))


def evidence_of(sums: AxisSums) -> ShapeEvidence:
    """Return the evidence for each shape of one axis by all estimates of all units.

    Scales of the noise are those of the largest likelihood, at least 1; the variance of sizes about a mean is that of
    the restricted likelihood.
    """
    solved = [common_size(sums, shape) for shape in range(len(sums.shapes))]
    gain, k = np.array([each[1] for each in solved]), np.array([each[2] for each in solved], dtype=np.float64)
    n = np.maximum(sums.units, 1.0)
    many = n * np.maximum(sums.directions, 1.0)
    penalty = 0.5 * np.log1p(n)
    rest, rest_many = np.maximum(sums.whole - sums.squares, 0.0), np.maximum(sums.all_directions - many, 0.0)
    whole = rest + sums.squares
    nothing = _log_likelihood(whole, many + rest_many, noise_scale(whole, many + rest_many))

    def with_mean(scale: Array) -> Array:
        return np.asarray(0.5 * gain / scale * n / (1 + n) - k * penalty)

    noise = noise_scale(whole - gain, many + rest_many - k)
    common = _log_likelihood(whole, many + rest_many, noise) + with_mean(noise) - nothing
    beside = noise_scale(rest, rest_many)
    of_rest = _log_likelihood(rest, rest_many, beside) - nothing - penalty
    about_zero = of_rest + _log_likelihood(sums.squares, many, np.maximum(noise_scale(sums.squares, many), beside))
    scale = np.maximum(noise_scale(sums.squares - gain, many - k), beside)
    about_mean = of_rest + _log_likelihood(sums.squares, many, scale) + with_mean(scale)
    is_shown = k > 0
    common, about_zero, about_mean = (np.where(is_shown, each, -np.inf) for each in (common, about_zero, about_mean))
    likeliest = np.sqrt(np.where(common >= np.maximum(about_zero, about_mean), noise, beside))
    return ShapeEvidence(common, about_zero, about_mean, gain, likeliest)


def common_evidence(sums: AxisSums, noise: float) -> ShapeEvidence:
    """Return the evidence for a common size of each shape of one axis, at a known scale of the noise."""
    solved = [common_size(sums, shape) for shape in range(len(sums.shapes))]
    gain, k = np.array([each[1] for each in solved]), np.array([each[2] for each in solved], dtype=np.float64)
    n = np.maximum(sums.units, 1.0)
    common = 0.5 * gain / noise**2 * n / (1 + n) - 0.5 * k * np.log1p(n)
    none = np.full(len(k), -np.inf)
    return ShapeEvidence(np.where(k > 0, common, -np.inf), none, none, gain, np.full(len(k), noise))
