"""Coefficients that a reader expects and a fit does not estimate itself: the root of an estimated square."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from labctl.json_types.models import Coefficient, CoefficientTable

#: Estimated square -> name and unit of its root.
ROOTS: Mapping[str, tuple[str, str]] = {"k_squared": ("k", "rad/(rad/s)")}
#: A root is identified when its square is this many of its standard uncertainties above 0.
IDENTIFIED = 3.0
#: Probability that an unidentified root lies below `at_most`.
BOUND = 0.95
#: Quantiles over which the spread of an unidentified root is taken.
QUANTILES = 200


@dataclass(frozen=True)
class _Root:
    """The root of a square, and whether the data determine it; where not, its 95 % bound."""

    value: float
    u: float | None
    identified: bool
    at_most: float | None


def with_derived(coefficients: Mapping[str, Coefficient]) -> dict[str, Coefficient]:
    """Return name -> value, u and unit with the roots of squares added.

    A root has `identified` besides; where that is false the data do not determine it: its value and u describe the
    distribution that a square above 0 leaves, and `at_most` is its 95 % bound.
    """
    found = dict(coefficients)
    for square, (name, unit) in ROOTS.items():
        if square in found:
            root = _root(found[square]["value"], found[square]["u"])
            found[name] = {
                "value": root.value, "u": root.u, "identified": root.identified, "at_most": root.at_most, "unit": unit,
            }  # fmt: skip
    return found


def with_derived_tables(tables: Mapping[str, CoefficientTable]) -> dict[str, CoefficientTable]:
    """Return the same of coefficients that have a value at each node of a temperature table."""
    found = dict(tables)
    for square, (name, unit) in ROOTS.items():
        if square in found:
            roots = [_root(*each) for each in zip(found[square]["value"], found[square]["u"], strict=True)]
            found[name] = {
                "value": [root.value for root in roots],
                "u": [root.u for root in roots],
                "identified": [root.identified for root in roots],
                "at_most": [root.at_most for root in roots],
                "unit": unit,
            }
    return found


def _root(value: float, u: float | None) -> _Root:
    root = float(np.sqrt(max(value, 0.0)))
    if u is None or not np.isfinite(u):
        return _Root(root, None, identified=False, at_most=None)
    if value > IDENTIFIED * u:
        return _Root(root, u / (2 * root), identified=True, at_most=None)
    share = float(ndtr(value / u)) if u > 0 else 1.0
    if share < 1e-12:  # so far below 0 that no root is left
        return _Root(0.0, 0.0, identified=False, at_most=0.0)
    squares = value + u * ndtri(1 - share * (1 - (np.arange(QUANTILES) + 0.5) / QUANTILES))
    roots = np.sqrt(np.maximum(squares, 0.0))
    return _Root(float(roots.mean()), float(roots.std()), identified=False, at_most=float(np.quantile(roots, BOUND)))
