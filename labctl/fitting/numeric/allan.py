"""Overlapping Allan deviation of a static record, and the figures of IEEE Std 952 that it shows.

Allan variances at octaves of averaging time are compared with the sum of the standard's terms. Each of them is close to
a chi-square with equivalent degrees of freedom (NIST SP 1065, table 5) that depend on which term prevails there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.special import chdtri

from labctl.fitting.numeric.arrays import Array

#: Fewer readings than this say nothing about noise.
LEAST_READINGS = 300
#: The longest averaging time is this share of the record.
LONGEST_SHARE = 0.25
CONFIDENCE = 0.95
#: A term is shown when the record's deviance rises by this without it (about 99.5 %, as octaves share readings) ...
SHOWN_DEVIANCE = 9.0
#: ... and when it is this share of the variance at some averaging time.
SHOWN_SHARE = 0.3
#: Variances at neighbouring octaves of one record share readings; found by simulation, it makes u cover as it should.
NEIGHBOURS = 1.6
ROUNDS = 30
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
    """Return the Allan deviation of evenly spaced rates (n,) deg/s; None where they are too few or do not scatter."""
    n = len(rate_dps)
    if n < LEAST_READINGS or not np.ptp(rate_dps) > 0:
        return None
    m = np.exp2(np.arange(int(np.log2(n * LONGEST_SHARE)) + 1, dtype=np.float64))
    tau = np.asarray(m * period_s, dtype=np.float64)
    variance = np.array([overlapping_variance(rate_dps, int(k)) for k in m])
    if not np.all(variance > 0):
        return None
    terms, freedom = _terms(variance, tau, m, n + 1.0)
    tail = (1 - CONFIDENCE) / 2
    model = _design(tau) @ terms
    return Allan(
        tau,
        np.sqrt(variance),
        np.sqrt(variance * freedom / chdtri(freedom, tail)),
        np.sqrt(variance * freedom / chdtri(freedom, 1 - tail)),
        np.sqrt(model),
        {k.letter: _figure(j, terms, tau, freedom) for j, k in enumerate(KINDS) if k.letter in REPORTED},
        n * period_s,
    )


def _design(tau: Array) -> NDArray[np.float64]:
    return np.column_stack([kind.shape(tau) for kind in KINDS])


def _terms(variance: Array, tau: Array, m: Array, phases: float) -> tuple[Array, Array]:
    """Return the squared coefficients (5,), those that do not show at 0, and the degrees of freedom (k,)."""
    design = _design(tau)
    freedom = np.maximum(_white(phases, m), 1.0)
    terms = np.zeros(len(KINDS))
    for _ in range(2):  # the terms say which noise prevails where, and that says how sure each variance is
        terms = _fewest(design, variance, freedom)
        prevailing = np.argmax(design * terms, axis=1)
        table = np.column_stack([kind.freedom(phases, m) for kind in KINDS])
        freedom = np.maximum(table[np.arange(len(m)), prevailing], 1.0)
    return terms, freedom


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
        found, _ = nnls(columns / size, variance * weight)
        before = model
        model = np.maximum(design[:, kept] @ (found / size), 1e-12 * variance)
        terms[kept] = found / size
        if np.allclose(model, before, rtol=1e-8):
            break
    ratio = variance / model
    return terms, float(np.sum(freedom * (ratio - np.log(ratio) - 1.0)))


def _figure(j: int, terms: Array, tau: Array, freedom: Array) -> Figure:
    kind, design = KINDS[j], _design(tau)
    model = design @ terms
    value = float(np.sqrt(terms[j]))
    if value > 0 and float(np.max(design[:, j] * terms[j] / model)) >= SHOWN_SHARE:
        u_squared = _u_squared(j, np.flatnonzero(terms), design, model, freedom)
        return Figure(kind.scale * value, kind.scale * u_squared / (2 * value), kind.unit)
    # beside everything that may have taken its place
    u_squared = _u_squared(j, np.arange(len(KINDS)), design, model, freedom)
    why = f"no {kind.region} averaging times of {tau[0]:.3g} to {tau[-1]:.3g} s: other noise covers it"
    return Figure(None, None, kind.unit, kind.scale * float(np.sqrt(terms[j] + 1.645 * u_squared)), why)


def _u_squared(j: int, kept: NDArray[np.int64], design: NDArray[np.float64], model: Array, freedom: Array) -> float:
    """Return the standard uncertainty of a squared coefficient beside the others that are kept."""
    weighted = design[:, kept] * (np.sqrt(freedom / 2) / model)[:, None]
    size = np.linalg.norm(weighted, axis=0)
    covariance = np.linalg.pinv(weighted.T @ weighted / np.outer(size, size)) / np.outer(size, size)
    here = int(np.flatnonzero(kept == j)[0])
    return NEIGHBOURS * float(np.sqrt(covariance[here, here]))
