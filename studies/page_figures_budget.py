"""Standard uncertainties of the bench and their coverage, written here from the documentation: NumPy only.

`docs/explanation/uncertainty-budget.md` states them under *Lines* and *Coverage*.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from studies.page_figures_formulas import Law

Array = np.ndarray
#: Quantities of which the unit's own thermometer takes off the error, and angles of which only the cosine is lost.
CANCEL, ANGLES = ("thermometer", "chamber_gradient"), ("fixture_angle", "tilt", "mounting_repeatability")
#: Standard uncertainty of a figure of a data sheet over the figure.
CONVENTIONS = {"1 sigma": 1.0, "maximum": 1 / math.sqrt(3), "peak to peak": 1 / math.sqrt(12), "typical": 1.48}
#: What a half width is divided by.
DISTRIBUTIONS = {"rectangular": math.sqrt(3), "triangular": math.sqrt(6), "u-shaped": math.sqrt(2)}
COVERAGE = 0.9545
#: Points of the integral of Student's distribution.
STEPS = 20_001


def u_of(standard: Mapping[str, Any]) -> float:
    """Return the standard uncertainty of a reference standard, in its unit."""
    if standard["u"] is not None:
        return float(standard["u"])
    if standard["expanded"] is not None:
        return float(standard["expanded"] / standard["k"])
    return float(standard["half_width"] / DISTRIBUTIONS[standard["distribution"]])


def line_of(
    standard: Mapping[str, Any], law: Law, axis: str, rate_dps: float, temperature_c: float, horizontal_dps: float
) -> list[float]:
    """Return u, sensitivity and contribution of a reference standard to a corrected rate about one axis, deg/s.

    `horizontal_dps` is the horizontal part of the Earth's rate.
    """
    u, quantity = u_of(standard), standard["quantity"]
    if quantity == "clock":
        return [u, 1e-6 * rate_dps, 1e-6 * abs(rate_dps) * u]
    if quantity in CANCEL:
        return [u, 0.0, 0.0]
    if quantity in ANGLES:  # the root mean square of r (a^2 + b^2) / 2, with a and b normal
        return [u, 0.0, math.sqrt(2) * abs(rate_dps) * math.radians(u) ** 2]
    if quantity == "level":  # all outputs were off alike
        inverse = np.linalg.inv(law.at(np.array([temperature_c]))[1][0])
        slope = math.radians(horizontal_dps) * float(abs(inverse[law.axes.index(axis)].sum()))
        return [u, slope, slope * u]
    raise ValueError(f"{quantity}: a standard that is not written here; write it")


def of_datasheet(figure: float, convention: str) -> float:
    """Return the standard uncertainty of a repeatability by a data sheet: of the run calibrated and of another one."""
    return math.sqrt(2) * figure * CONVENTIONS[convention]


def effective_freedom(contributions: Sequence[float], freedoms: Sequence[float | None]) -> float:
    """Return the effective degrees of freedom by Welch and Satterthwaite; None is infinitely many."""
    total = sum(each**2 for each in contributions) ** 2
    return total / sum(each**4 / nu for each, nu in zip(contributions, freedoms, strict=True) if nu)


def coverage_factor(freedom: float) -> float:
    """Return the factor that Student's distribution needs for the coverage probability."""
    t = np.linspace(0.0, 60.0, 40 * (STEPS - 1) + 1)
    logs = math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2) - 0.5 * math.log(freedom * math.pi)
    density = np.exp(logs - (freedom + 1) / 2 * np.log1p(t**2 / freedom))
    inside = 2 * np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2) * (t[1] - t[0])])
    return float(np.interp(COVERAGE, inside, t))


def leaning_rad(standards: Sequence[Mapping[str, Any]]) -> float:
    """Return the standard uncertainty of the direction of an axis in one mounting, about one direction across it."""
    return math.radians(math.hypot(*(u_of(each) for each in standards if each["quantity"] in ANGLES)))
