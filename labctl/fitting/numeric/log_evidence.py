"""Log evidence, nats, of what has alternatives: the mean over shapes, and over "on all axes, or on one"."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from labctl.fitting.numeric.arrays import Array


def mean_evidence(log_bf: ArrayLike, tried: int) -> Array:
    """Return the log of the mean Bayes factor, (...) nats, of alternatives (n, ...) that are equally probable
    beforehand.

    `tried` is how many there were: one whose size is not physical (-inf) was tried too, and counts as 0.
    """
    # many small sums: NumPy's function does one in a fifth of the time of SciPy's logsumexp
    return np.asarray(np.logaddexp.reduce(log_bf) - np.log(tried))


def on_all_axes_or_one(per_axis: ArrayLike) -> Array:
    """Return the log Bayes factors of causes over all axes, nats, (...), by those of each axis alone, (axes, ...).

    A cause is on all axes with a probability of one half, otherwise on any single one of them.
    """
    each = np.asarray(per_axis, dtype=np.float64)
    axes = len(each)
    if axes == 1:
        return np.asarray(each[0])
    joint = each.sum(axis=0, keepdims=True) - np.log(2.0)
    return np.asarray(np.logaddexp.reduce(np.concatenate([joint, each - np.log(2.0 * axes)])))
