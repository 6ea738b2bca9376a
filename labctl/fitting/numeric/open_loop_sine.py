"""The ratio sin(sqrt(x)) / sqrt(x) as a function of x: 1 at 0, and sinh(sqrt(-x)) / sqrt(-x) below.

It is analytic in x, so that a fit of the squared modulation constant K^2 passes through 0 without a seam: a negative
estimate says that the data bend the other way, and that no sine fits them.
"""

from __future__ import annotations

import numpy as np

from labctl.fitting.numeric.arrays import Array

#: Below this |x| the series is exact to double precision in the ratio, and better than 1e-12 in its slope.
NEAR_ZERO = 1e-3


def sine_ratio(x: Array) -> Array:
    """Return sin(sqrt(x)) / sqrt(x), (n,)."""
    root = np.sqrt(np.maximum(np.abs(x), NEAR_ZERO))
    far = np.where(x > 0, np.sin(root), np.sinh(np.minimum(root, 50.0))) / root
    near = 1 - x / 6 * (1 - x / 20 * (1 - x / 42 * (1 - x / 72)))
    return np.where(np.abs(x) < NEAR_ZERO, near, far)


def cosine_of_root(x: Array) -> Array:
    """Return cos(sqrt(x)), cosh(sqrt(-x)) below 0, (n,): the derivative of a * sine_ratio(q a^2) along a."""
    root = np.sqrt(np.abs(x))
    return np.where(x > 0, np.cos(root), np.cosh(np.minimum(root, 50.0)))


def sine_ratio_slope(x: Array) -> Array:
    """Return the derivative of `sine_ratio`, (n,)."""
    apart = np.where(np.abs(x) < NEAR_ZERO, 1.0, x)
    far = (cosine_of_root(x) - sine_ratio(x)) / (2 * apart)
    near = -1 / 6 * (1 - x / 10 * (1 - x / 28 * (1 - x / 54)))
    return np.where(np.abs(x) < NEAR_ZERO, near, far)
