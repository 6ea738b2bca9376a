"""Overlapping Allan deviation of a static record, and the figures of IEEE Std 952 that it shows.

Allan variances at octaves of averaging time are compared with the sum of the standard's terms. Each of them is close to
a chi-square with equivalent degrees of freedom (NIST SP 1065, table 5) that depend on which term prevails there.
The figures rest on the octaves at which an output filter and the steps of the output leave the noise as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtrc

from labctl.fitting.numeric.allan_bounds import is_filtered_white, largest_coefficients
from labctl.fitting.numeric.allan_terms import (
    DEG_PER_HOUR,
    KINDS,
    MIN_OCTAVES,
    REPORTED,
    SMOOTHED,
    SMOOTHED_SHARE,
    WHITE,
    design_of,
    fit_terms,
    freedom_of,
    kept_beside,
    likeliest_correlation,
)
from labctl.fitting.numeric.arrays import Array

# Slow trend of a record at rest: a warm-up or a drift that the beginning of a record holds and noise does not.
#
# Means of equal pieces of a record differ from one to the next. Of a random walk those differences are alike and
# without order throughout; of a warm-up they are large at first and die away, of a ramp they have one sign. So
# straight lines, parabolas and exponentials are fitted to the differences, and the best is believed when an F-test
# asks for it.

#: Pieces into which a record is divided.
PIECES = 32
#: Time constants of a warm-up that are tried, as shares of the record.
SHARES = (0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
#: Probability at which noise without any trend is taken for one.
FALSE_ALARM = 0.01


def slow_trend(rate_dps: Array) -> Array | None:
    """Return the trend of evenly spaced rates (n,), (n,) deg/s about 0; None where the record has none."""
    size = len(rate_dps) // PIECES
    if size < 2:
        return None
    steps = np.diff(rate_dps[: size * PIECES].reshape(PIECES, size).mean(axis=1))
    if not np.any(steps):
        return None
    centres = (np.arange(PIECES) + 0.5) * size / len(rate_dps)
    laws = [np.column_stack([centres, centres**2, centres**3])]
    laws += [np.column_stack([centres, np.exp(-centres / share)]) for share in SHARES]
    chances, fits = zip(*(_fit(np.diff(law, axis=0), steps) for law in laws), strict=True)
    best = int(np.argmin(chances))
    if chances[best] * len(laws) > FALSE_ALARM:
        return None
    at = np.arange(len(rate_dps)) / len(rate_dps)
    columns = [at, at**2, at**3] if best == 0 else [at, np.exp(-at / SHARES[best - 1])]
    trend = np.column_stack(columns) @ fits[best]
    return np.asarray(trend - trend.mean())


def _fit(design: NDArray[np.float64], steps: Array) -> tuple[float, Array]:
    """Return the probability that random steps fit a design as well by chance, and its coefficients."""
    coefficients, *_ = np.linalg.lstsq(design, steps)
    chi2 = float(np.sum((steps - design @ coefficients) ** 2))
    k, freedom = design.shape[1], len(steps) - design.shape[1]
    gained = max(float(steps @ steps) - chi2, 0.0)
    return float(fdtrc(k, freedom, gained / k / max(chi2 / freedom, 1e-300))), np.asarray(
        coefficients, dtype=np.float64
    )


# Whether the steps of an output are larger than its noise, so that a record shows the steps and hides the noise.
#
# With a standard deviation of half a step or more in front of the converter, rounding adds step^2 / 12 and nothing else
# (Widrow and Kollar, Quantization Noise, 2008). With less, the readings stay in one code or jump between two: they then
# scatter by less or by more than the noise does, as the mean lies within a code or between two.

#: A record is read in this many blocks of this many readings.
BLOCKS, BLOCK = 200, 256
#: Readings outside the two commonest codes of a block: Gaussian noise of 0.3 steps about a code has this share.
OUTSIDE_SHARE = 0.05


def hiding_step(readings: Array) -> float | None:
    """Return the step of readings (n,), in their unit, where it hides their noise; None where it does not."""
    size = min(BLOCK, len(readings))
    starts = np.unique(np.linspace(0, len(readings) - size, BLOCKS).astype(np.int64))
    outside, step = [], np.inf
    for start in starts:
        codes, counts = np.unique(readings[start : start + size], return_counts=True)
        outside.append(1.0 - float(np.sort(counts)[-2:].sum()) / size)
        if len(codes) > 1:
            step = min(step, float(np.diff(codes).min()))
    if not np.mean(outside) < OUTSIDE_SHARE:
        return None
    if np.isfinite(step):
        return step
    codes = np.unique(readings)  # no block has two codes
    return float(np.diff(codes).min()) if len(codes) > 1 else None


#: Fewer readings than this say nothing about noise.
MIN_READINGS = 300
#: The longest averaging time is this share of the record.
LONGEST_SHARE = 0.25
CONFIDENCE = 0.95
#: A term is shown only where it is this share of the variance at some averaging time.
SHOWN_SHARE = 0.3
#: The same share of a record whose trend was subtracted: the trend has absorbed some of the noise at longer times.
LONGEST_SHARE_TRENDLESS = 0.125
#: A random walk counts where it prevails over this many octaves and more: it is read beyond the record. So does white
#: noise where the shortest averaging times were left out.
PREVAILING_OCTAVES = 3
#: A figure has a value when it is this many of its standard uncertainties; of what is less sure there is a bound.
KNOWN = 3.0
#: Where a term shows, the fitted curve lies within intervals that hold such noise at all octaves with this chance.
FAMILY_CONFIDENCE = 0.99
#: Least part of white noise at which a filter's law holds beside the part that the law lowers as far as it can.
MIN_UNSMOOTHED = 0.1
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
    model_dps: Array  #: the fitted sum of terms; NaN at shorter averaging times than `from_s`
    figures: Mapping[str, Figure]  #: N, B, K
    duration_s: float
    from_s: float  #: shortest averaging time of those that the figures rest on
    trend_dps: float = 0.0  #: size of the slow trend (warm-up) that is no noise, from its lowest to its highest
    smoothing_s: float = 0.0  #: mean distance of two readings' instants that an output filter weighs together, at least
    step_dps: float | None = None  #: step of an output whose steps hide the noise

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
    if n < MIN_READINGS or not np.ptp(rate_dps) > 0:
        return None
    m = np.exp2(np.arange(int(np.log2(n * LONGEST_SHARE)) + 1, dtype=np.float64))
    tau = np.asarray(m * period_s, dtype=np.float64)
    variance = _variances(rate_dps, m)
    if not np.all(variance > 0):
        return None
    trend = slow_trend(rate_dps)
    still = variance if trend is None else _variances(rate_dps - trend, m)
    octaves = len(m) if trend is None else int(np.sum(m <= n * LONGEST_SHARE_TRENDLESS))
    step = hiding_step(rate_dps)
    fitted = _Octaves(still[:octaves], tau[:octaves], m[:octaves], n + 1.0).followed()
    bounds = largest_coefficients(variance, tau, m, n + 1.0, from_s=float(fitted.tau[0]), step=step or 0.0)
    is_shown = np.flatnonzero(tau >= fitted.tau[0])
    design = design_of(tau[is_shown], fitted.correlation_s)
    freedom = np.empty(len(m))
    freedom[is_shown] = freedom_of(design, fitted.terms, m[is_shown], n + 1.0)
    freedom[: is_shown[0]] = np.maximum(KINDS[WHITE].freedom(n + 1.0, m[: is_shown[0]]), 1.0)
    model = np.full(len(m), np.nan)
    model[is_shown] = design @ fitted.terms + (0.0 if trend is None else _variances(trend, m[is_shown]))
    tail = (1 - CONFIDENCE) / 2
    return Allan(
        tau,
        np.sqrt(variance),
        np.sqrt(variance * freedom / chdtri(freedom, tail)),
        np.sqrt(variance * freedom / chdtri(freedom, 1 - tail)),
        np.sqrt(model),
        {k.letter: _figure(j, fitted, bounds, step) for j, k in enumerate(KINDS) if k.letter in REPORTED},
        n * period_s,
        float(fitted.tau[0]),
        0.0 if trend is None else float(np.ptp(trend)),
        fitted.smoothing_s,
        step,
    )


@dataclass(frozen=True)
class _Fitted:
    """Squared coefficients (6,), and the averaging times, variances and degrees of freedom that they were fitted to."""

    terms: Array
    shows: NDArray[np.bool_]  #: (6,) whether the record cannot be explained without the term
    tau: Array
    variance: Array
    freedom: Array
    quantized: bool  #: whether the shortest averaging time is among them, where quantization shows
    correlation_s: float | None = None  #: of the correlated noise that the terms include

    @property
    def model(self) -> Array:
        return design_of(self.tau, self.correlation_s) @ self.terms

    @property
    def smoothing_s(self) -> float:
        """Mean distance of two instants that the output filter weighs, s."""
        white = self.terms[WHITE] + self.terms[SMOOTHED]
        share = self.terms[SMOOTHED] / white if self.shows[SMOOTHED] and white > 0 else 0.0
        return float(share * SMOOTHED_SHARE * self.tau[0] / 1.5)

    @property
    def is_smoothed_beyond(self) -> bool:
        """Whether white noise is lowered by more than the terms can follow: by a filter longer than these octaves."""
        return bool(self.shows[SMOOTHED] and self.terms[WHITE] < MIN_UNSMOOTHED * self.terms[SMOOTHED])

    def columns(self, j: int) -> list[int]:
        """Return the columns of the design whose coefficients together are a term's."""
        return [WHITE, SMOOTHED] if j == WHITE else [j]

    def share(self, j: int) -> Array:
        """Return the share of a term in the fitted variance, (k,)."""
        columns = self.columns(j)
        return design_of(self.tau, self.correlation_s)[:, columns] @ self.terms[columns] / self.model

    def is_shown(self, j: int) -> bool:
        """Return whether the record cannot be explained without a term."""
        return bool(self.shows[self.columns(j)].any())

    def is_followed(self, is_shown: NDArray[np.bool_]) -> bool:
        """Return whether the fitted curve lies within the data's intervals at the octaves where a term shows."""
        tail = (1 - FAMILY_CONFIDENCE) / 2 / len(self.tau)
        ratio = self.freedom * self.variance / self.model
        inside = (ratio > chdtri(self.freedom, 1 - tail)) & (ratio < chdtri(self.freedom, tail))
        return bool(np.all(inside[is_shown]))


@dataclass(frozen=True)
class _Octaves:
    """Variances (k,), (deg/s)^2, at averaging times in s and in readings; and the number of readings and one."""

    variance: Array
    tau: Array
    m: Array
    phases: float

    def fit(self, first: int = 0, correlation_s: float | None = None) -> _Fitted:
        """Return the fit from an octave on; quantization shows at the shortest of all averaging times or nowhere."""
        variance, tau, m = self.variance[first:], self.tau[first:], self.m[first:]
        terms, shows, freedom = fit_terms(variance, tau, m, self.phases, correlation_s, quantized=first == 0)
        return _Fitted(terms, shows, tau, variance, freedom, first == 0, correlation_s)

    def followed(self) -> _Fitted:
        """Return the fit to the most octaves, from one on, at which white noise shows and the variances follow it.

        What shorter times have beside it, the exact form of a filter or a vibration, is no noise of the standard.
        Without white noise that is followed from any octave on it is the fit to all.
        """
        whole = self.fit()
        everywhere = np.ones(len(self.tau), dtype=bool)
        if (whole.is_followed(everywhere) and not whole.is_smoothed_beyond) or _shows_white(whole, 1):
            return whole
        likeliest = likeliest_correlation(self.variance, self.tau, self.m, self.phases)
        later = (self.fit(k) for k in range(1, len(self.m) - MIN_OCTAVES + 1))
        rivals = itertools.chain([self.fit(0, likeliest)], later)
        explained = (fit for fit in rivals if _shows_white(fit, PREVAILING_OCTAVES) and self._explained_before(fit))
        return next(explained, whole)

    def _explained_before(self, fit: _Fitted) -> bool:
        before = slice(len(self.tau) - len(fit.tau) + 1)
        white = float(fit.terms[fit.columns(WHITE)].sum())
        return is_filtered_white(self.variance[before], self.tau[before], white)


def _shows_white(fitted: _Fitted, octaves: int) -> bool:
    share = fitted.share(WHITE)
    is_shown = share >= SHOWN_SHARE
    prevails = int(np.sum(share >= 0.5)) >= octaves and share[0] >= 0.5
    is_white = fitted.is_shown(WHITE) and not fitted.is_smoothed_beyond
    return is_white and prevails and fitted.is_followed(is_shown)


def _variances(rate_dps: Array, m: Array) -> Array:
    return np.array([overlapping_variance(rate_dps, int(k)) for k in m])


def _figure(j: int, fitted: _Fitted, bounds: Array, step: float | None) -> Figure:
    kind = KINDS[j]
    value = float(np.sqrt(fitted.terms[fitted.columns(j)].sum()))
    bound = kind.scale * float(bounds[j])
    u = 0.0 if value == 0 else _u_squared(j, fitted) / (2 * value)
    reason = _why_unknown(j, fitted, step, value, u)
    if reason:
        return Figure(None, None, kind.unit, bound, reason)
    return Figure(kind.scale * value, kind.scale * u, kind.unit)


def _why_unknown(j: int, fitted: _Fitted, step: float | None, value: float, u: float) -> str:
    """Return why a term has no value; empty where it has one."""
    kind = KINDS[j]
    span = f"averaging times of {fitted.tau[0]:.3g} to {fitted.tau[-1]:.3g} s"
    share = fitted.share(j)
    is_shown = share >= SHOWN_SHARE
    octaves = int(np.sum(share >= 0.5))
    slope = f"no {kind.region} {span}"
    short = f"slope +1/2 at fewer than {PREVAILING_OCTAVES} octaves of {span}: the record is too short to detect a"
    uncertain = f"{kind.scale * value:.3g} {kind.unit}, uncertain by {100 * u / max(value, 1e-300):.0f} %"
    hidden = step is not None and bool(np.any(fitted.variance[is_shown] < step**2))
    reasons = (
        (not (fitted.is_shown(j) and is_shown.any()), f"{slope}: masked by other noise"),
        (hidden, f"the output has steps of {step or 0.0:.3g} deg/s, which hide noise smaller than that"),
        (j == WHITE and fitted.is_smoothed_beyond, f"{slope}: an output filter smooths the noise for longer"),
        (kind.letter == "K" and octaves < PREVAILING_OCTAVES, f"{short} random walk"),
        (not fitted.is_followed(is_shown), f"{slope}: the deviation does not follow that slope"),
        (value < KNOWN * u, f"no clear {kind.region} {span}: {uncertain}"),
    )
    return next((reason for holds, reason in reasons if holds), "")


def _u_squared(j: int, fitted: _Fitted) -> float:
    """Return the standard uncertainty of a term's squared coefficient.

    It is that beside the terms that are kept, and those that the record does not show and that may be there
    nevertheless.
    """
    terms_used = kept_beside(fitted.terms, quantized=fitted.quantized)
    columns = design_of(fitted.tau, fitted.correlation_s)[:, terms_used]
    weighted = columns * (np.sqrt(fitted.freedom / 2) / fitted.model)[:, None]
    size = np.linalg.norm(weighted, axis=0)
    covariance = np.linalg.pinv(weighted.T @ weighted / np.outer(size, size)) / np.outer(size, size)
    of_term = np.isin(terms_used, fitted.columns(j)).astype(np.float64)
    return NEIGHBOURS * float(np.sqrt(of_term @ covariance @ of_term))
