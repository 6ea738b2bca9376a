"""When to calibrate again: the date on which an error leaves its limit, and intervals by the methods of ILAC-G24.

ILAC-G24:2022 / OIML D 10:2022 names five methods. Here are the staircase (method 1: the interval grows while errors are
within 80 % of the limit and shrinks where one is outside), the control chart (method 2: drift and scatter of the item's
own history), and the time in use (method 3: the staircase in hours of use). Each answer states its risk: the
probability that the item is outside of its limit when it comes back.

The steps of a staircase balance at its target: (1 + up)^R (1 - down)^(1 - R) = 1, so that an item that is found within
its limit with probability R keeps its interval on average (NCSLI RP-1, method A1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from labctl.errors import BadInput
from labctl.probability_text import risk_text

YEAR = timedelta(days=365.25)
#: Share of the limit within which an error extends the interval (ILAC-G24, method 1).
EXTEND_WITHIN = 0.8
#: Probability of being within the limit that an interval is meant to keep, and the share that a staircase goes down by.
TARGET, DOWN = 0.95, 0.45
#: Intervals are kept between these, years.
MIN_YEARS, MAX_YEARS = 1.0 / 12.0, 10.0
#: Time over which the leaving of a limit is searched for, years, and the step of the search.
HORIZON_YEARS, STEP_YEARS = 50.0, 0.02
#: Probabilities at the ends of the interval of a leaving date.
EARLY, LATE = 0.025, 0.975
#: Calibrations without which a control chart says nothing: a line, and one that it can miss.
MIN_CHART = 3
#: Degrees of freedom beyond which a t-distribution is a normal one.
MAX_FREEDOM = 1e6

Array = NDArray[np.float64]
Decision = Literal["extend", "keep", "reduce"]


@dataclass(frozen=True)
class PastCalibration:
    """What a calibration found before any adjustment: the error of the item, in the unit of the limit."""

    on: date
    error: float
    u: float  #: standard uncertainty of the error
    use_h: float | None = None  #: hours of use since the calibration before; None: not recorded


@dataclass(frozen=True)
class Rate:
    """Change of an error per year, predicted: expected value, standard uncertainty and its degrees of freedom."""

    mean: float
    u: float
    freedom: float = MAX_FREEDOM


@dataclass(frozen=True)
class Leaving:
    """When an error is expected to leave its limit, in years from its calibration; None: not within 50 years."""

    expected_years: float | None  #: where the expected error reaches the limit
    early_years: float | None  #: with a probability of 2.5 % it has left before
    late_years: float | None  #: with a probability of 97.5 % it has left before


@dataclass(frozen=True)
class Interval:
    """A recalibration interval."""

    years: float  #: of use where the method counts hours of use, else of the calendar
    decision: Decision  #: by comparison with the interval before
    risk: float | None  #: probability of being outside of the limit at its end; None: the drift is not known
    why: str


def risk_at(years: Array | float, error: float, u: float, rate: Rate, limit: float) -> Array:
    """Return the probability that an error is outside of +-limit some years after it was measured."""
    t = np.asarray(years, dtype=np.float64)
    spread = np.sqrt(u**2 + (rate.u * t) ** 2)
    expected = error + rate.mean * t
    freedom = min(max(rate.freedom, 1.0), MAX_FREEDOM)
    size = np.maximum(spread, 1e-300)
    return np.asarray(stdtr(freedom, (-limit - expected) / size) + stdtr(freedom, (expected - limit) / size))


def leaving(error: float, u: float, rate: Rate, limit: float) -> Leaving:
    """Return when an error leaves +-limit. Raises BadInput for a limit that is not above 0."""
    _require_limit(limit)
    years = np.arange(0.0, HORIZON_YEARS + STEP_YEARS, STEP_YEARS)
    outside = np.abs(error + rate.mean * years) >= limit
    risk = np.maximum.accumulate(risk_at(years, error, u, rate, limit))
    return Leaving(_first(years, outside), _first(years, risk >= EARLY), _first(years, risk >= LATE))


def interval_for_risk(error: float, u: float, rate: Rate, limit: float, target: float = TARGET) -> Interval:
    """Return the longest interval at whose end the item is within its limit with a probability of `target`."""
    _require_limit(limit)
    years = np.arange(0.0, MAX_YEARS + STEP_YEARS, STEP_YEARS)
    risk = np.maximum.accumulate(risk_at(years, error, u, rate, limit))
    allowed = years[risk <= 1.0 - target]
    longest = float(allowed[-1]) if len(allowed) else 0.0
    chosen = float(np.clip(longest, MIN_YEARS, MAX_YEARS))
    at_end = float(risk_at(chosen, error, u, rate, limit))
    return Interval(chosen, "keep", at_end, f"the risk at its end is {risk_text(at_end)} by the predicted drift")


def staircase(
    history: Sequence[PastCalibration], years: float, limit: float, rate: Rate | None = None, target: float = TARGET
) -> Interval:
    """Return the next interval by the newest calibration of an item whose interval was `years` (ILAC-G24, method 1).

    Raises BadInput without a calibration, for a limit that is not above 0, or a target that is not between 0 and 1.
    """
    _require_limit(limit)
    if not history:
        raise BadInput("no calibration to derive an interval from; calibrate the item first")
    if not 0.0 < target < 1.0:
        raise BadInput(f"target = {target:g} is no probability between 0 and 1; give the share in limits, such as 0.95")
    newest = max(history, key=lambda each: each.on)
    share = abs(newest.error) / limit
    up = (1.0 - DOWN) ** (-(1.0 - target) / target) - 1.0
    if share > 1.0:
        decision: Decision = "reduce"
        factor = 1.0 - DOWN
    elif share <= EXTEND_WITHIN:
        decision, factor = "extend", 1.0 + up
    else:
        decision, factor = "keep", 1.0
    chosen = float(np.clip(years * factor, MIN_YEARS, MAX_YEARS))
    risk = None if rate is None else float(risk_at(chosen, newest.error, newest.u, rate, limit))
    return Interval(chosen, decision, risk, f"the error found is {100 * share:.3g} % of the limit")


def in_use_time(
    history: Sequence[PastCalibration], use_h: float, limit: float, hours_per_year: float, target: float = TARGET
) -> Interval:
    """Return the next interval of an item that is used `hours_per_year`, h, after `use_h` hours of use (method 3).

    The interval is in years of this use. Raises BadInput as `staircase`, and for a use that is not above 0.
    """
    if not (hours_per_year > 0 and use_h > 0):
        raise BadInput(
            f"use of {use_h:g} h, {hours_per_year:g} h per year: both must be above 0 h; record the hours of use of "
            "the item, or derive the interval from the calendar"
        )
    return staircase(history, use_h / hours_per_year, limit, None, target)


def control_chart_rate(history: Sequence[PastCalibration]) -> Rate:
    """Return drift and its uncertainty from an item's own history (method 2). Raises BadInput with fewer than three.

    The line's scatter, at least that of the stated uncertainties, is what a rate to come is uncertain by.
    """
    ordered = sorted(history, key=lambda each: each.on)
    if len({each.on for each in ordered}) < MIN_CHART:
        raise BadInput(
            f"{len(ordered)} calibrations on different days are too few for a control chart; at least {MIN_CHART} are "
            "needed: use the drift of the type, or the staircase"
        )
    t = np.array([(each.on - ordered[0].on) / YEAR for each in ordered])
    root = 1.0 / np.array([max(each.u, 1e-300) for each in ordered])
    columns = np.column_stack([np.ones(len(t)), t]) * root[:, None]
    y = np.array([each.error for each in ordered]) * root
    covariance = np.linalg.inv(columns.T @ columns)
    values = covariance @ (columns.T @ y)
    freedom = len(t) - 2
    birge = max(1.0, float(np.sum((y - columns @ values) ** 2)) / freedom)
    return Rate(float(values[1]), math.sqrt(birge * float(covariance[1, 1])), float(freedom))


def control_chart(history: Sequence[PastCalibration], years: float, limit: float, target: float = TARGET) -> Interval:
    """Return the longest interval by an item's own drift and scatter (method 2), compared with the one before."""
    rate = control_chart_rate(history)
    newest = max(history, key=lambda each: each.on)
    interval = interval_for_risk(newest.error, newest.u, rate, limit, target)
    decision: Decision = (
        "extend" if interval.years > 1.05 * years else "reduce" if interval.years < 0.95 * years else "keep"
    )
    return Interval(interval.years, decision, interval.risk, interval.why)


def _first(years: Array, where: NDArray[np.bool_]) -> float | None:
    return float(years[int(np.argmax(where))]) if np.any(where) else None


def _require_limit(limit: float) -> None:
    if not (math.isfinite(limit) and limit > 0):
        raise BadInput(f"limit = {limit:g}: a limit of the error must be a number above 0; give the permissible error")
