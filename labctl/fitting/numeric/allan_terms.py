"""Noise terms of IEEE Std 952 in an Allan variance, and the fit of their sizes.

The variance at each averaging time is close to a chi-square with equivalent degrees of freedom (NIST SP 1065, table 5)
that depend on which term prevails there.

An output that a filter has smoothed scatters less at short averaging times than its white noise would. With an impulse
response h of area 1 and two independent times t, t' drawn from it, the angle's mean square change over tau is
N^2 (tau - a), a = E|t - t'|, as soon as tau exceeds the filter's memory: so the variance is N^2 / tau (1 - 1.5 a / tau)
whatever the filter is. Where the exact form of the filter still shows, the octaves are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.nonnegative import nonnegative_least_squares

#: A term is shown when the deviance of the record rises by this without it (about 99.5 %, as octaves share readings).
SHOWN_DEVIANCE = 9.0
ROUNDS = 30
#: Variances follow a sum of power laws to this share at best: lines, filters and rounding are in every real output.
TOLERANCE = 0.02
#: At the first octave smoothing lowers white noise by at most this share: with more the filter's exact form shows.
SMOOTHED_SHARE = 0.4
#: Octaves that a fit needs.
MIN_OCTAVES = 5
#: A model of the variances has converged when none changes by more than this share.
CONVERGED = 1e-6
DEG_PER_ROOT_HOUR = 60.0
DEG_PER_HOUR = 3600.0


@dataclass(frozen=True)
class Kind:
    """One term of the standard: variance = coefficient^2 x shape(tau), and its degrees of freedom (n phases, m)."""

    letter: str
    word: str
    unit: str
    scale: float  #: from deg/s and s to the unit
    shape: Callable[[Array], Array]
    freedom: Callable[[float, Array], Array]
    region: str  #: where it shows


def _white(n: float, m: Array) -> Array:
    return (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5)


def _flicker(n: float, m: Array) -> Array:
    return np.where(m == 1, 2 * (n - 2) ** 2 / (2.3 * n - 4.9), 5 * n**2 / (4 * m * (n + 3 * m)))


def _walk(n: float, m: Array) -> Array:
    return (n - 2) / m * ((n - 1) ** 2 - 3 * m * (n - 1) + 4 * m**2) / (n - 3) ** 2


def _angle(n: float, m: Array) -> Array:
    return (n + 1) * (n - 2 * m) / (2 * (n - m))


KINDS: tuple[Kind, ...] = (
    Kind("Q", "quantization", "deg", 1.0, lambda tau: 3 / tau**2, _angle, "slope -1 at the shortest"),
    Kind("N", "angle random walk", "deg/sqrt(h)", DEG_PER_ROOT_HOUR, lambda tau: 1 / tau, _white,
         "slope -1/2 at short"),
    Kind("B", "bias instability", "deg/h", DEG_PER_HOUR, lambda tau: np.full_like(tau, 2 * np.log(2) / np.pi), _flicker,
         "flat part at middle"),
    Kind("K", "rate random walk", "deg/h/sqrt(h)", DEG_PER_HOUR * DEG_PER_ROOT_HOUR, lambda tau: tau / 3, _walk,
         "slope +1/2 at long"),
    Kind("R", "rate ramp", "deg/h/h", DEG_PER_HOUR**2, lambda tau: tau**2 / 2, _walk, "slope +1 at the longest"),
)  # fmt: skip
#: The figures that are reported; the others are only kept from spoiling them.
REPORTED = ("N", "B", "K")
BESIDE = tuple(j for j, kind in enumerate(KINDS) if kind.letter in REPORTED)


#: Columns of a design behind those of the KINDS: smoothed white noise, and correlated noise where there is some.
SMOOTHED, CORRELATED = len(KINDS), len(KINDS) + 1
QUANTIZATION, WHITE, FLICKER = (next(j for j, kind in enumerate(KINDS) if kind.letter == letter) for letter in "QNB")


def design_of(tau: Array, correlation_s: float | None = None) -> NDArray[np.float64]:
    """Return the variances of unit coefficients: each of the KINDS, white noise that is smoothed, and correlated noise.

    The last is first-order Markov noise of a correlation time, of unit standard deviation; (k, 6) without it.
    """
    smoothed = (1 - SMOOTHED_SHARE * tau[0] / tau) / tau
    columns = [*(kind.shape(tau) for kind in KINDS), smoothed]
    if correlation_s is not None:
        x = tau / correlation_s
        columns.append(2 / x * (1 + (np.expm1(-x) * (3 - np.exp(-x))) / (2 * x)))
    return np.column_stack(columns)


def fit_terms(
    variance: Array, tau: Array, m: Array, phases: float, correlation_s: float | None = None, *, quantized: bool = True
) -> tuple[Array, NDArray[np.bool_], Array]:
    """Return the squared coefficients (6,) or (7,), which of them show, and the degrees of freedom (k,) of the fit."""
    design = design_of(tau, correlation_s)
    freedom = tolerant(np.maximum(_white(phases, m), 1.0))
    terms = np.zeros(design.shape[1])
    for _ in range(2):  # the terms say which noise prevails where, and that says how sure each variance is
        terms = _fewest(design, variance, freedom, quantized=quantized)
        freedom = tolerant(freedom_of(design, terms, m, phases))
    # what shows is sized beside what does not and may be there nevertheless: else it would take that in
    sized, _ = _fit(design, variance, freedom, kept_beside(terms, quantized=quantized))
    return sized, terms > 0, freedom


def kept_beside(terms: Array, *, quantized: bool) -> list[int]:
    """Return the columns that show or may be there; smoothing may be where the first octaves were left out."""
    return sorted({*np.flatnonzero(terms).tolist(), *BESIDE, *(() if quantized else (SMOOTHED,))})


def likeliest_correlation(variance: Array, tau: Array, m: Array, phases: float) -> float:
    """Return the correlation time, s, with which correlated noise beside all terms follows the variances best."""
    freedom = tolerant(np.maximum(KINDS[FLICKER].freedom(phases, m), 1.0))
    every = [*range(1, len(KINDS)), SMOOTHED, CORRELATED]
    tried = np.exp2(np.arange(np.log2(4 * tau[0]), np.log2(tau[-1] / 2), 0.5))
    deviances = [_fit(design_of(tau, each), variance, freedom, every)[1] for each in tried.tolist()]
    return float(tried[int(np.argmin(deviances))])


def tolerant(freedom: Array) -> Array:
    """Return the degrees of freedom of variances that follow a sum of power laws only to the TOLERANCE."""
    return 1.0 / (1.0 / freedom + TOLERANCE**2 / 2.0)


def freedom_of(design: NDArray[np.float64], terms: Array, m: Array, phases: float) -> Array:
    """Return the degrees of freedom of each variance, (k,), by the term that prevails there."""
    prevailing = np.argmax(design * terms, axis=1)
    freedoms = [kind.freedom(phases, m) for kind in KINDS]
    table = np.column_stack([*freedoms, freedoms[WHITE], freedoms[FLICKER]])
    return np.maximum(table[np.arange(len(m)), prevailing], 1.0)


def _fewest(design: NDArray[np.float64], variance: Array, freedom: Array, *, quantized: bool) -> Array:
    """Return the terms after leaving out, one by one, those that the record does not show.

    Quantization and smoothing are the same law with two signs, so they are rivals.
    """
    every = [j for j in range(design.shape[1]) if j not in {QUANTIZATION, SMOOTHED}]
    rivals = [
        _pruned(design, variance, freedom, sorted([*every, first]))
        for first in ((QUANTIZATION, SMOOTHED) if quantized else (SMOOTHED,))
    ]
    return min(rivals, key=lambda candidate: candidate[1])[0]


def _pruned(design: NDArray[np.float64], variance: Array, freedom: Array, terms_kept: list[int]) -> tuple[Array, float]:
    """Return the terms that are left, and their deviance with what each of them costs."""
    terms, deviance = _fit(design, variance, freedom, terms_kept)
    while len(terms_kept) > 1:
        tried = [(_fit(design, variance, freedom, [j for j in terms_kept if j != out]), out) for out in terms_kept]
        (fewer, without), out = min(tried, key=lambda pair: pair[0][1])
        if without - deviance > SHOWN_DEVIANCE:
            break
        terms_kept = [j for j in terms_kept if j != out]
        terms, deviance = fewer, without
    return terms, deviance + SHOWN_DEVIANCE * len(terms_kept)


def _fit(design: NDArray[np.float64], variance: Array, freedom: Array, terms_kept: list[int]) -> tuple[Array, float]:
    """Return squared coefficients >= 0 that make chi-square distributed variances likeliest, and their deviance."""
    terms = np.zeros(design.shape[1])
    model = variance
    for _ in range(ROUNDS):
        weight = np.sqrt(freedom / 2) / model
        columns = design[:, terms_kept] * weight[:, None]
        size = np.linalg.norm(columns, axis=0)
        coefficients = nonnegative_least_squares(columns / size, variance * weight)
        before = model
        model = np.maximum(design[:, terms_kept] @ (coefficients / size), 1e-12 * variance)
        terms[terms_kept] = coefficients / size
        if np.all(np.abs(model - before) <= CONVERGED * before):
            break
    ratio = variance / model
    return terms, float(np.sum(freedom * (ratio - np.log(ratio) - 1.0)))
