"""Comparison of two results of one quantity: En number and zeta score.

En = (x - X) / sqrt(U(x)^2 + U(X)^2) with expanded uncertainties (ISO 13528:2015, 9.7; ISO/IEC 17043:2010, B.3.1.3 e),
zeta = (x - X) / sqrt(u(x)^2 + u(X)^2) with standard uncertainties (ISO 13528:2015, 9.6). Both formulas hold for
independent results. Results that share a standard are correlated: the covariance of what they share is subtracted under
the root (GUM, JCGM 100:2008, 5.2.2), as the shared error cancels in the difference.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from labctl.errors import BadInput

Performance = Literal["satisfactory", "questionable", "unsatisfactory"]


@dataclass(frozen=True)
class Result:
    """A result with its standard uncertainty and coverage factor."""

    value: float
    u: float
    k: float = 2.0

    @property
    def expanded(self) -> float:
        """Expanded uncertainty."""
        return self.k * self.u


def en_number(first: Result, second: Result, covariance: float = 0.0) -> float:
    """Return the En number of two results; `covariance` is that of their standard uncertainties, in the unit squared.

    Raises BadInput for uncertainties without which the number is not defined.
    """
    shared = first.k * second.k * covariance
    return (first.value - second.value) / _root(first.expanded, second.expanded, shared)


def zeta_score(first: Result, second: Result, covariance: float = 0.0) -> float:
    """Return the zeta score of two results; arguments and errors as of `en_number`."""
    return (first.value - second.value) / _root(first.u, second.u, covariance)


def en_performance(en: float) -> Performance:
    """Return what an En number says: |En| <= 1 is satisfactory (ISO 13528:2015, 9.7.2)."""
    return "satisfactory" if abs(en) <= 1.0 else "unsatisfactory"


def zeta_performance(zeta: float) -> Performance:
    """Return what a zeta score says: up to 2 satisfactory, from 3 unsatisfactory (ISO 13528:2015, 9.4.2 and 9.6.2)."""
    if abs(zeta) <= 2.0:
        return "satisfactory"
    return "questionable" if abs(zeta) < 3.0 else "unsatisfactory"


def _root(first: float, second: float, shared: float) -> float:
    if not (math.isfinite(first) and math.isfinite(second) and first >= 0 and second >= 0):
        raise BadInput(f"uncertainties {first:g} and {second:g}: give two finite numbers, 0 or above")
    variance = first**2 + second**2 - 2.0 * shared
    if not variance > 0:
        raise BadInput(
            f"uncertainties {first:g} and {second:g} with a shared part of {shared:g}: nothing is left in which the "
            "results are independent; compare results that do not rest on the same standards only"
        )
    return math.sqrt(variance)
