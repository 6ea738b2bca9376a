"""Evidence against the further coefficients of a wider effect, where a simpler one explains as much.

A wider effect contains a simpler one where it reproduces its signal: with more coefficients, of which the further ones
then happen to vanish. How unlikely that is follows from how well they are known: were the wider effect the cause, each
of its coefficients would be of the size of what is seen. The unit-information prior, by which effects compete, does not
ask this: with it the price of a coefficient grows with the number of data sets, and not with the strength of a signal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Directions of which less than this share of the largest is known are not seen, and say nothing.
UNSEEN = 1e-12


def further_nats(
    wider: Array, covariance: NDArray[np.float64], through: NDArray[np.float64], simple: Array, size: Array
) -> float:
    """Return the log Bayes factor, nats, for the further coefficients of a wider effect being 0.

    `wider` (k,) are its coefficients beside the base and `covariance` (k, k) theirs; `through` (k, j) are those with
    which it reproduces each column of the simple effect, whose coefficients are `simple` (j,). `size` (k,) is the root
    mean square of each column of the wider effect, which makes their coefficients comparable, deg/s.

    The prior of each coefficient is normal, with the root mean square of those that reproduce the simple effect as its
    standard deviation. Both hypotheses are normal in the further directions (Dickey, Ann. Math. Stat. 42, 204, 1971).
    """
    fitted, known = wider * size, covariance * np.outer(size, size)
    spans = through * size[:, None]
    prior_var = float(np.sum((spans @ simple) ** 2)) / max(len(fitted), 1)
    left, singular, _ = np.linalg.svd(spans, full_matrices=True)
    rank = int(np.sum(singular > 1e-9 * max(float(singular.max(initial=0.0)), 1e-300)))
    further = left[:, rank:]
    if not prior_var > 0 or further.shape[1] == 0:
        return 0.0
    variances, vectors = np.linalg.eigh(further.T @ known @ further)
    seen = variances > UNSEEN * max(float(variances.max(initial=0.0)), 1e-300)
    variance = variances[seen]
    off = (vectors.T @ (further.T @ fitted))[seen] ** 2
    widened = variance + prior_var
    return float(0.5 * np.sum(np.log(widened / variance) - off * (1.0 / variance - 1.0 / widened)))
