"""Coefficients that a reader expects and a fit does not estimate itself: the root of an estimated square."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

#: Estimated square -> name and unit of its root.
ROOTS: Mapping[str, tuple[str, str]] = {"k_squared": ("k", "rad/(rad/s)")}
#: A root is identified when its square is this many of its standard uncertainties above 0.
IDENTIFIED = 3.0
#: Probability that an unidentified root lies below `at_most`.
BOUND = 0.95
#: Quantiles over which the spread of an unidentified root is taken.
QUANTILES = 200


def with_derived(coefficients: Mapping[str, Any]) -> dict[str, Any]:
    """Return name -> value, u and unit with the roots of squares added.

    A root has `identified` besides; where that is false the data do not determine it: its value and u describe the
    distribution that a square above 0 leaves, and `at_most` is its 95 % bound.
    """
    found = dict(coefficients)
    for square, (name, unit) in ROOTS.items():
        if square in found:
            found[name] = {**_root(found[square]["value"], found[square]["u"]), "unit": unit}
    return found


def _root(value: Any, u: Any) -> dict[str, Any]:
    if isinstance(value, list):
        roots = [_root(one, error) for one, error in zip(value, u, strict=True)]
        return {key: [root[key] for root in roots] for key in ("value", "u", "identified", "at_most")}
    root = float(np.sqrt(max(value, 0.0)))
    if u is None or not np.isfinite(u):
        return {"value": root, "u": None, "identified": False, "at_most": None}
    if value > IDENTIFIED * u:
        return {"value": root, "u": u / (2 * root), "identified": True, "at_most": None}
    share = float(ndtr(value / u)) if u > 0 else 1.0
    if share < 1e-12:  # so far below 0 that no root is left
        return {"value": 0.0, "u": 0.0, "identified": False, "at_most": 0.0}
    squares = value + u * ndtri(1 - share * (1 - (np.arange(QUANTILES) + 0.5) / QUANTILES))
    roots = np.sqrt(np.maximum(squares, 0.0))
    return {
        "value": float(roots.mean()),
        "u": float(roots.std()),
        "identified": False,
        "at_most": float(np.quantile(roots, BOUND)),
    }
