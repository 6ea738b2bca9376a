"""Overlapping Allan deviation of a static record, and the figures of IEEE Std 952 that it shows.

Allan variances at octaves of averaging time are compared with the sum of the standard's terms. Each of them is close to
a chi-square with equivalent degrees of freedom (NIST SP 1065, table 5) that depend on which term prevails there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from labctl.fitting.numeric.allan_terms import (
    BESIDE,
    DEG_PER_HOUR,
    KINDS,
    REPORTED,
    design_of,
    fit_terms,
    freedom_of,
)
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.slow_trend import slow_trend

#: Fewer readings than this say nothing about noise.
LEAST_READINGS = 300
#: The longest averaging time is this share of the record.
LONGEST_SHARE = 0.25
CONFIDENCE = 0.95
#: A term is shown only where it is this share of the variance at some averaging time.
SHOWN_SHARE = 0.3
#: The same share of a record whose trend was subtracted: the trend has absorbed some of the noise at longer times.
LONGEST_SHARE_TRENDLESS = 0.125
#: A random walk counts where it prevails over this many octaves and more: it is read beyond the record.
PREVAILING_OCTAVES = 3
#: A figure has a value when it is this many of its standard uncertainties; of what is less sure there is a bound.
KNOWN = 3.0
#: Where a term shows, the fitted curve lies within intervals that hold such noise at all octaves with this chance.
FAMILY_CONFIDENCE = 0.99
#: Chance that a bound on a term which has no value is above the truth; smaller alternatives at several octaves compete.
BOUND_CONFIDENCE = 0.995
#: Variances at neighbouring octaves of one record share readings; found by simulation, it makes u cover as it should.
NEIGHBOURS = 1.6


@dataclass(frozen=True)
class Figure:
    """One figure of the standard; `value` is None where the record does not show it, and then `why` says so."""

    value: float | None
    u: float | None
    unit: str
    at_most: float | None = None  #: 95 % bound, where there is no value
    why: str = ""


@dataclass(frozen=True)
class Allan:
    """The Allan deviation of one record, (k,) each in s and deg/s, with its 95 % interval, and what it shows."""

    tau_s: Array
    deviation_dps: Array
    low_dps: Array
    high_dps: Array
    model_dps: Array  #: the fitted sum of terms
    figures: Mapping[str, Figure]  #: N, B, K
    duration_s: float
    trend_dps: float = 0.0  #: size of the slow trend (warm-up) that is no noise, from its lowest to its highest

    @property
    def instability_dps(self) -> float | None:
        """Bias instability B in deg/s, or None where the record does not show it."""
        value = self.figures["B"].value
        return None if value is None else value / DEG_PER_HOUR


def overlapping_variance(rate_dps: Array, m: int) -> float:
    """Return the overlapping Allan variance of rates (n,) averaged over m of them, (deg/s)^2; needs n >= 2 m."""
    angle = np.concatenate([[0.0], np.cumsum(rate_dps - rate_dps.mean())])
    second = angle[2 * m :] - 2 * angle[m:-m] + angle[: -2 * m]
    return float(np.mean(second**2) / (2.0 * m**2))


def allan(rate_dps: Array, period_s: float) -> Allan | None:
    """Return the Allan deviation of evenly spaced rates (n,) deg/s; None where they are too few or do not scatter.

    The deviation is that of the record as it is. The terms are those of the record without its slow trend, whose own
    deviation is added to the fitted curve.
    """
    n = len(rate_dps)
    if n < LEAST_READINGS or not np.ptp(rate_dps) > 0:
        return None
    m = np.exp2(np.arange(int(np.log2(n * LONGEST_SHARE)) + 1, dtype=np.float64))
    tau = np.asarray(m * period_s, dtype=np.float64)
    variance = _variances(rate_dps, m)
    if not np.all(variance > 0):
        return None
    trend = slow_trend(rate_dps)
    still = variance if trend is None else _variances(rate_dps - trend, m)
    kept = slice(None) if trend is None else slice(int(np.sum(m <= n * LONGEST_SHARE_TRENDLESS)))
    terms, shows, seen = fit_terms(still[kept], tau[kept], m[kept], n + 1.0)
    freedom = freedom_of(terms, tau, m, n + 1.0)
    model = design_of(tau) @ terms + (0.0 if trend is None else _variances(trend, m))
    tail = (1 - CONFIDENCE) / 2
    fitted = _Fitted(terms, shows, tau[kept], still[kept], seen, _bounds(variance, tau, m, n + 1.0))
    return Allan(
        tau,
        np.sqrt(variance),
        np.sqrt(variance * freedom / chdtri(freedom, tail)),
        np.sqrt(variance * freedom / chdtri(freedom, 1 - tail)),
        np.sqrt(model),
        {k.letter: _figure(j, fitted) for j, k in enumerate(KINDS) if k.letter in REPORTED},
        n * period_s,
        0.0 if trend is None else float(np.ptp(trend)),
    )


@dataclass(frozen=True)
class _Fitted:
    """Squared coefficients (5,), and the averaging times, variances and degrees of freedom that they were fitted to."""

    terms: Array
    shows: NDArray[np.bool_]  #: (5,) whether the record cannot be explained without the term
    tau: Array
    variance: Array
    freedom: Array
    bounds: Array  #: (5,) largest coefficient that each term may have by the record as it is

    @property
    def model(self) -> Array:
        return design_of(self.tau) @ self.terms

    def share(self, j: int) -> Array:
        """Return the share of a term in the fitted variance, (k,)."""
        return design_of(self.tau)[:, j] * self.terms[j] / self.model

    def is_followed(self, shown: NDArray[np.bool_]) -> bool:
        """Return whether the fitted curve lies within the data's intervals at the octaves where a term shows."""
        tail = (1 - FAMILY_CONFIDENCE) / 2 / len(self.tau)
        ratio = self.freedom * self.variance / self.model
        inside = (ratio > chdtri(self.freedom, 1 - tail)) & (ratio < chdtri(self.freedom, tail))
        return bool(np.all(inside[shown]))


def _variances(rate_dps: Array, m: Array) -> Array:
    return np.array([overlapping_variance(rate_dps, int(k)) for k in m])


def _bounds(variance: Array, tau: Array, m: Array, phases: float) -> Array:
    """Return the largest coefficient of each term, (5,), that alone would not exceed the record at any octave."""
    found = []
    for kind in KINDS:
        freedom = np.maximum(kind.freedom(phases, m), 1.0)
        highest = variance * freedom / chdtri(freedom, BOUND_CONFIDENCE)
        found.append(float(np.sqrt(np.min(highest / kind.shape(tau)))))
    return np.array(found)


def _figure(j: int, fitted: _Fitted) -> Figure:
    kind, design, model = KINDS[j], design_of(fitted.tau), fitted.model
    value, bound = float(np.sqrt(fitted.terms[j])), kind.scale * float(fitted.bounds[j])
    span = f"averaging times of {fitted.tau[0]:.3g} to {fitted.tau[-1]:.3g} s"
    share = fitted.share(j)
    shown = share >= SHOWN_SHARE
    if not (fitted.shows[j] and shown.any()):
        return Figure(None, None, kind.unit, bound, f"no {kind.region} {span}: masked by other noise")
    if kind.letter == "K" and int(np.sum(share >= 0.5)) < PREVAILING_OCTAVES:
        why = (
            f"slope +1/2 at fewer than {PREVAILING_OCTAVES} octaves of {span}: the record is too short to detect a "
            "random walk"
        )
        return Figure(None, None, kind.unit, bound, why)
    if not fitted.is_followed(shown):
        return Figure(
            None, None, kind.unit, bound, f"no {kind.region} {span}: the deviation does not follow that slope"
        )
    # beside those that the record does not show and that may be there nevertheless
    beside = np.union1d(np.flatnonzero(fitted.terms), BESIDE)
    u_squared = _u_squared(j, beside, design, model, fitted.freedom)
    u = u_squared / (2 * value)
    if value < KNOWN * u:
        why = (
            f"no clear {kind.region} {span}: {kind.scale * value:.3g} {kind.unit}, uncertain by {100 * u / value:.0f} %"
        )
        return Figure(None, None, kind.unit, bound, why)
    return Figure(kind.scale * value, kind.scale * u, kind.unit)


def _u_squared(j: int, kept: NDArray[np.int64], design: NDArray[np.float64], model: Array, freedom: Array) -> float:
    """Return the standard uncertainty of a squared coefficient beside the others that are kept."""
    weighted = design[:, kept] * (np.sqrt(freedom / 2) / model)[:, None]
    size = np.linalg.norm(weighted, axis=0)
    covariance = np.linalg.pinv(weighted.T @ weighted / np.outer(size, size)) / np.outer(size, size)
    here = int(np.flatnonzero(kept == j)[0])
    return NEIGHBOURS * float(np.sqrt(covariance[here, here]))
