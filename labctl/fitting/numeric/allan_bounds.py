"""Largest coefficients of the terms that a record is compatible with, where it does not show their sizes."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from labctl.fitting.numeric.allan_terms import KINDS, WHITE
from labctl.fitting.numeric.arrays import Array

#: Chance that a bound on a term which has no value is above the truth; smaller alternatives at several octaves compete.
BOUND_CONFIDENCE = 0.995
#: The logarithm of a sum of power laws bends upwards; it bends downwards when it does so by this many deviations.
BENDS = 3.0
#: Share by which a filter may have lowered the first octave after: a moving average takes it at its own length.
LOWERED_SHARE = 0.5
#: A filter's law may be missed by this share of the white noise.
LAW_TOLERANCE = 0.05


def largest_coefficients(variance: Array, tau: Array, m: Array, phases: float, *, from_s: float, step: float) -> Array:
    """Return the largest coefficient of each term, (5,), that alone would not exceed the record at any octave.

    `step` is that of an output whose steps hide the noise, in the unit of the rates, or 0: such readings are each up to
    half of it away. Octaves below `from_s`, and those that a filter may have lowered, do not count, nor the first after
    them wholly.
    """
    first = max(_unfiltered_from(variance, m, phases), int(np.searchsorted(tau, from_s * (1 - 1e-9))))
    lowered = 1 - LOWERED_SHARE * tau[first] / tau[first:]
    bounds = []
    for kind in KINDS:
        freedom = np.maximum(kind.freedom(phases, m), 1.0)[first:]
        highest = np.sqrt(variance[first:] * freedom / chdtri(freedom, BOUND_CONFIDENCE)) + step / 2
        bounds.append(float(np.min(highest / np.sqrt(lowered * kind.shape(tau[first:])))))
    return np.array(bounds)


def _unfiltered_from(variance: Array, m: Array, phases: float) -> int:
    """Return the first octave after the last at which the variances bend downwards, as only a filter or wave lets them.

    Sums of power laws with coefficients above 0 are convex in logarithms of both (Hoelder).
    """
    relative = 2 / np.maximum(KINDS[WHITE].freedom(phases, m), 1.0)
    log = np.log(variance)
    bend = log[2:] - 2 * log[1:-1] + log[:-2]
    deviation = np.sqrt(relative[2:] + 4 * relative[1:-1] + relative[:-2])
    down = np.flatnonzero(bend < -BENDS * deviation)
    return int(down[-1]) + 2 if len(down) else 0


def is_filtered_white(variance: Array, tau: Array, white: float) -> bool:
    """Return whether variances (k,) at octaves are white noise N^2 behind an output filter, or more than that.

    Of first-order filters, moving averages and sample-and-hold outputs the share g of white noise that is left grows
    from one octave to the next by half of itself, or by half of what is missing where that is less. White noise that
    is lower at short averaging times and does not grow so is lower, and what is above it at longer times is no white
    noise.
    """
    share = variance * tau / white
    grown = np.minimum(1.5 * share, (1 + share) / 2)[:-1] - LAW_TOLERANCE
    return bool(np.all(share[1:] >= np.minimum(grown, 1 - LAW_TOLERANCE)))
