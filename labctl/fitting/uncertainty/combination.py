"""Combining contributions to an uncertainty (GUM, JCGM 100: 5.1, 5.2, G.4), also of those that are not normal."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import j0, ndtr

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY, student_factor

#: Share of the variance that is not normal below which the factor is that of a normal distribution.
MIN_SHARE = 0.1
#: A standard uncertainty of this share of the whole is added to what is not normal, so that its integral converges.
SMOOTHING = 0.02
#: Nodes of that integral, and how far it goes in units of one over the normal part.
NODES, REACH = 6000, 5.0
#: Where the factor is looked for, and how exactly.
MIN_K, MAX_K, TOLERANCE = 0.5, 6.0, 1e-8


def combined_u(contributions: Array, correlation: Array | None = None) -> float:
    """Return the combined standard uncertainty of signed contributions c_i u_i, (n,), in their unit (GUM eq. 13).

    `correlation` (n, n) holds the correlation coefficients; without it the inputs are independent.
    """
    if correlation is None:
        return math.sqrt(float(contributions @ contributions))
    return math.sqrt(max(float(contributions @ correlation @ contributions), 0.0))


def effective_freedom(contributions: Sequence[float], freedom: Sequence[float | None]) -> float | None:
    """Return the effective degrees of freedom of independent contributions (Welch-Satterthwaite, GUM eq. G.2b).

    `freedom` is None for a contribution that is exactly known; None is returned where all are.
    """
    total = sum(contribution**2 for contribution in contributions) ** 2
    estimated = sum(
        contribution**4 / nu for contribution, nu in zip(contributions, freedom, strict=True) if nu is not None
    )
    return total / estimated if estimated > 0 and total > 0 else None


def coverage_factor(
    contributions: Sequence[float],
    distributions: Sequence[str],
    freedom: float | None,
    probability: float = COVERAGE_PROBABILITY,
) -> float:
    """Return k of an interval k u_c that covers with a `probability`.

    Contributions that are not normal count by their own distribution (JCGM 101, here by the product of the
    characteristic functions instead of by trials): where a rectangular one dominates, k is nearer 1.65 than 2. Few
    degrees of freedom widen by Student's t.
    """
    size = np.abs(np.asarray(contributions, dtype=np.float64))
    total = float(np.sqrt(size @ size))
    normal = np.array([name not in _CHARACTERISTIC for name in distributions])
    widening = student_factor(freedom, probability) / student_factor(None, probability)
    if total == 0 or float(size[~normal] @ size[~normal]) < MIN_SHARE * total**2:
        return student_factor(None, probability) * widening
    shares = size / total
    spread = math.hypot(float(np.sqrt(shares[normal] @ shares[normal])), SMOOTHING)
    t = np.linspace(0.0, REACH / spread, NODES)[1:]
    phi = np.exp(-0.5 * (spread * t) ** 2)
    for share, name in zip(shares, distributions, strict=True):
        if name in _CHARACTERISTIC:
            phi = phi * _CHARACTERISTIC[name](share * t)

    weight = phi / t

    def excess(k: float) -> float:
        # (2/pi) times the integral of phi(t) sin(k t) / t, by the trapezoidal rule
        return 2 / math.pi * (float(weight @ np.sin(k * t)) + 0.5 * k) * float(t[0]) - probability

    from scipy.optimize import brentq

    return float(brentq(excess, MIN_K, MAX_K, xtol=TOLERANCE)) * widening


def half_width(expanded: float, offset: float, probability: float = COVERAGE_PROBABILITY) -> float:
    """Return the half width of an interval about a stated value that is off by a known, uncorrected error, in its unit.

    The rest of the error is normal with an expanded uncertainty of `expanded` for the same `probability`. Adding the
    size of the known error to it (GUM F.2.4.5) would cover more: of an error that is large beside the rest only one
    side counts (Phillips, Eberhardt and Parry 1997, J. Res. NIST 102, 577).
    """
    u = expanded / student_factor(None, probability)
    if offset == 0 or u == 0:
        return expanded + abs(offset)
    off = abs(offset) / u
    most = (
        off + student_factor(None, probability) + TOLERANCE
    )  # beyond the root also where rounding hides a tiny offset
    from scipy.optimize import brentq

    return u * float(brentq(lambda k: ndtr(k - off) - ndtr(-k - off) - probability, off, most, xtol=TOLERANCE))


def _rectangular(t: Array) -> Array:
    return np.asarray(np.sinc(math.sqrt(3.0) * t / math.pi))


def _triangular(t: Array) -> Array:
    return np.asarray(np.sinc(math.sqrt(6.0) * t / 2 / math.pi) ** 2)


def _u_shaped(t: Array) -> Array:
    return np.asarray(j0(math.sqrt(2.0) * t))


#: Characteristic functions of distributions of unit variance at t, (n,).
_CHARACTERISTIC = {"rectangular": _rectangular, "triangular": _triangular, "u-shaped": _u_shaped}
