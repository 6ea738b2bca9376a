"""Coefficients that a reader expects and a fit does not estimate itself: a root of a square, a bandwidth in Hz."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from labctl.answers.fitted_model import Coefficient, CoefficientTable

#: Estimated square -> name and unit of its root.
ROOTS: Mapping[str, tuple[str, str]] = {"k_squared": ("k", "rad/(rad/s)")}
#: Estimated time constant, s -> name and unit of the bandwidth: where the gain is 1 / sqrt(2), -3 dB.
BANDWIDTHS: Mapping[str, tuple[str, str]] = {"time_constant": ("bandwidth", "Hz")}
#: A time constant is identified when it, and a root when its square is this many of its standard uncertainties above 0.
IDENTIFIED = 3.0
#: Probability that an unidentified root lies below `at_most`.
BOUND = 0.95
#: Quantiles over which the spread of an unidentified root is taken.
QUANTILES = 200


@dataclass(frozen=True)
class _Derived:
    """A root or a bandwidth, and whether the data determine it; of a root that they do not, its 95 % bound."""

    value: float
    u: float | None
    identified: bool
    at_most: float | None


def with_derived(coefficients: Mapping[str, Coefficient]) -> dict[str, Coefficient]:
    """Return name -> value, u and unit with the roots of squares, and the bandwidths of time constants, added.

    A bandwidth that is not `identified` has no u: its value is the least that the data allow, with 95 %. A root has
    `identified` besides; where that is false the data do not determine it: its value and u describe the distribution
    that a square above 0 leaves, and `at_most` is its 95 % bound.
    """
    extended = dict(coefficients)
    for time, (name, unit) in BANDWIDTHS.items():
        if time in extended:
            band = _bandwidth(extended[time]["value"], extended[time]["u"])
            extended[name] = {"value": band.value, "u": band.u, "identified": band.identified, "unit": unit}
    for square, (name, unit) in ROOTS.items():
        if square in extended:
            root = _root(extended[square]["value"], extended[square]["u"])
            extended[name] = {
                "value": root.value, "u": root.u, "identified": root.identified, "at_most": root.at_most, "unit": unit,
            }  # fmt: skip
    return extended


def with_derived_tables(tables: Mapping[str, CoefficientTable]) -> dict[str, CoefficientTable]:
    """Return the same of coefficients that have a value at each node of a temperature table."""
    extended = dict(tables)
    for time, (name, unit) in BANDWIDTHS.items():
        if time in extended:
            bands = [_bandwidth(*each) for each in zip(extended[time]["value"], extended[time]["u"], strict=True)]
            extended[name] = {
                "value": [band.value for band in bands],
                "u": [band.u for band in bands],
                "identified": [band.identified for band in bands],
                "unit": unit,
            }
    for square, (name, unit) in ROOTS.items():
        if square in extended:
            roots = [_root(*each) for each in zip(extended[square]["value"], extended[square]["u"], strict=True)]
            extended[name] = {
                "value": [root.value for root in roots],
                "u": [root.u for root in roots],
                "identified": [root.identified for root in roots],
                "at_most": [root.at_most for root in roots],
                "unit": unit,
            }
    return extended


def _bandwidth(time_constant_s: float, u: float | None) -> _Derived:
    """Return the bandwidth in Hz of a time constant; where that may be 0, the least bandwidth with 95 %."""
    if u is not None and np.isfinite(u) and time_constant_s > IDENTIFIED * u:
        value = 1.0 / (2 * np.pi * time_constant_s)
        return _Derived(value, value * u / time_constant_s, identified=True, at_most=None)
    longest = max(time_constant_s, 0.0) + float(ndtri(BOUND)) * (u if u is not None and np.isfinite(u) else 0.0)
    return _Derived(1.0 / (2 * np.pi * max(longest, 1e-9)), None, identified=False, at_most=None)


def _root(value: float, u: float | None) -> _Derived:
    root = float(np.sqrt(max(value, 0.0)))
    if u is None or not np.isfinite(u):
        return _Derived(root, None, identified=False, at_most=None)
    if value > IDENTIFIED * u:
        return _Derived(root, u / (2 * root), identified=True, at_most=None)
    share = float(ndtr(value / u)) if u > 0 else 1.0
    if share < 1e-12:  # so far below 0 that no root is left
        return _Derived(0.0, 0.0, identified=False, at_most=0.0)
    squares = value + u * ndtri(1 - share * (1 - (np.arange(QUANTILES) + 0.5) / QUANTILES))
    roots = np.sqrt(np.maximum(squares, 0.0))
    return _Derived(float(roots.mean()), float(roots.std()), identified=False, at_most=float(np.quantile(roots, BOUND)))
