"""Noise terms of IEEE Std 952 in an Allan variance, and the fit of their sizes.

The variance at each averaging time is close to a chi-square with equivalent degrees of freedom (NIST SP 1065, table 5)
that depend on which term prevails there.
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
#: A model of the variances has converged when none changes by more than this share and this amount, (deg/s)^2.
CONVERGED, CONVERGED_VAR = 1e-8, 1e-8
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


def design_of(tau: Array) -> NDArray[np.float64]:
    return np.column_stack([kind.shape(tau) for kind in KINDS])


def fit_terms(variance: Array, tau: Array, m: Array, phases: float) -> tuple[Array, NDArray[np.bool_], Array]:
    """Return the squared coefficients (5,), which of them show (5,), and the degrees of freedom (k,)."""
    design = design_of(tau)
    freedom = np.maximum(_white(phases, m), 1.0)
    terms = np.zeros(len(KINDS))
    for _ in range(2):  # the terms say which noise prevails where, and that says how sure each variance is
        terms = _fewest(design, variance, freedom)
        freedom = freedom_of(terms, tau, m, phases)
    # what shows is sized beside what does not and may be there nevertheless: else it would take that in
    sized, _ = _fit(design, variance, freedom, sorted({*np.flatnonzero(terms).tolist(), *BESIDE}))
    return sized, terms > 0, freedom


def freedom_of(terms: Array, tau: Array, m: Array, phases: float) -> Array:
    """Return the degrees of freedom of each variance, (k,), by the term that prevails there."""
    prevailing = np.argmax(design_of(tau) * terms, axis=1)
    table = np.column_stack([kind.freedom(phases, m) for kind in KINDS])
    return np.maximum(table[np.arange(len(m)), prevailing], 1.0)


def _fewest(design: NDArray[np.float64], variance: Array, freedom: Array) -> Array:
    """Return the terms after leaving out, one by one, those that the record does not show."""
    kept = list(range(len(KINDS)))
    terms, deviance = _fit(design, variance, freedom, kept)
    while len(kept) > 1:
        tried = [(_fit(design, variance, freedom, [j for j in kept if j != out]), out) for out in kept]
        (fewer, without), out = min(tried, key=lambda pair: pair[0][1])
        if without - deviance > SHOWN_DEVIANCE:
            break
        kept.remove(out)
        terms, deviance = fewer, without
    return terms


def _fit(design: NDArray[np.float64], variance: Array, freedom: Array, kept: list[int]) -> tuple[Array, float]:
    """Return squared coefficients >= 0 that make chi-square distributed variances likeliest, and their deviance."""
    terms = np.zeros(design.shape[1])
    model = variance
    for _ in range(ROUNDS):
        weight = np.sqrt(freedom / 2) / model
        columns = design[:, kept] * weight[:, None]
        size = np.linalg.norm(columns, axis=0)
        found = nonnegative_least_squares(columns / size, variance * weight)
        before = model
        model = np.maximum(design[:, kept] @ (found / size), 1e-12 * variance)
        terms[kept] = found / size
        if np.all(np.abs(model - before) <= CONVERGED_VAR + CONVERGED * before):
            break
    ratio = variance / model
    return terms, float(np.sum(freedom * (ratio - np.log(ratio) - 1.0)))
