"""The largest error over all outputs and rate vectors at once, which each single U covers less often than stated.

A U covers the error at one rate vector. The largest of many errors is beyond the U of its own place more often, because
some direction, and some output, has an error that is large for it. What the sources add to an error is linear in the
rate vector, e(w) = a + E w, so the covariances at several vectors determine those of a and E, and the quantile of the
largest |e| follows by simulation (JCGM 101:2008, clause 7; simultaneous intervals after Scheffe 1959, section 3.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement

import numpy as np

from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.rate_vector import RateVectorUncertainty

#: Probability that no error is beyond the bound: that which a one-sided guard band of U has (ILAC-G8, table 1).
COVERAGE_PROBABILITY = 0.975
#: Coverage factor of U for a normal distribution.
NORMAL_K = 2.0
#: Draws of the simulation, and the seed: a bound is the same each time that it is computed.
DRAWS, SEED = 20_000, 106


def widening(
    uncertainties: Sequence[RateVectorUncertainty], outputs_by_place: Sequence[Sequence[str]] | None = None
) -> float:
    """Return by which factor U at the worst place has to be widened to cover the largest error of all outputs.

    `uncertainties` are those at several rate vectors of one temperature; `outputs_by_place` are the outputs that count
    at each of them (default: all). At least 1; NaN where a covariance is unknown.
    """
    outputs = uncertainties[0].outputs
    counts = np.array(
        [[output in counted for output in outputs] for counted in outputs_by_place or [outputs] * len(uncertainties)]
    )
    size = (
        max((abs(rate) for uncertainty in uncertainties for rate in uncertainty.rates_dps.values()), default=0.0) or 1.0
    )
    terms = np.array(
        [[1.0, *(uncertainty.rates_dps[axis] / size for axis in BODY_AXES)] for uncertainty in uncertainties]
    )
    covariance = np.array([uncertainty.covariance for uncertainty in uncertainties])
    variances = np.einsum("pii->pi", covariance)
    if not np.isfinite(variances[counts]).all():
        return float("nan")
    covariance = np.nan_to_num(covariance)
    u = np.sqrt(variances[counts]).max()
    drawn = np.random.default_rng(SEED).normal(size=(DRAWS, len(outputs) * terms.shape[1])) @ _root(terms, covariance).T
    errors = np.einsum("dit,pt->dpi", drawn.reshape(DRAWS, len(outputs), -1), terms)
    largest = np.abs(errors)[:, counts].max(axis=1)
    return max(float(np.quantile(largest, COVERAGE_PROBABILITY)) / (NORMAL_K * float(u)), 1.0)


def _root(terms: Array, covariance: Array) -> Array:
    """Return a root of the covariance of a and E, (n t, n t), from those of e at places (p, t), (p, n, n).

    By least squares, of the part that is symmetric in the terms, which is all that single places show; what is not
    positive is left out.
    """
    p, n, _ = covariance.shape
    t = terms.shape[1]
    pairs = list(combinations_with_replacement(range(t), 2))
    products = np.stack([terms[:, i] * terms[:, j] * (1.0 if i == j else 2.0) for i, j in pairs], axis=1)
    solved, *_ = np.linalg.lstsq(products, covariance.reshape(p, n * n), rcond=None)
    whole = np.zeros((n, t, n, t))
    for (i, j), values in zip(pairs, solved, strict=True):
        whole[:, i, :, j] = whole[:, j, :, i] = values.reshape(n, n)
    values, vectors = np.linalg.eigh(whole.reshape(n * t, n * t))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
