"""Ageing of a type: how the coefficients of its units change over years, by units that were calibrated more than once.

The slope of a unit has a known uncertainty, that of its calibrations; the slopes of the units have a mean and a spread
of their own. What both calibrations measured wrongly is so not taken for drift, as it is where only differences are
known (`labctl.fitting.uncertainty.drift_prediction`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.fleet.group_effects import robust_fit
from labctl.fitting.fleet.reml import reml
from labctl.fitting.fleet.unit_coefficients import YEAR, UnitCoefficients
from labctl.fitting.numeric.arrays import Array
from labctl.texts import counted

#: Units without which nothing is said of the ageing of a type.
MIN_UNITS = 3
#: Calibrations of a unit closer than this, years, say nothing of its ageing.
MIN_YEARS = 0.04
#: Slopes farther from the mean of the type than this, in standard deviations, do not widen its spread.
FAR = 4.5


@dataclass(frozen=True)
class CoefficientAgeing:
    """Change of one coefficient per year over the units of a type."""

    name: str
    unit: str  #: of the coefficient; the figures are per year
    mean: float
    u_mean: float  #: standard uncertainty of the mean
    spread: float  #: standard deviation of the rates of units
    spread_low: float  #: 95 % interval of the spread, from
    spread_high: float  #: to
    predictive_u: float  #: standard uncertainty of the rate of one more unit of the type
    freedom: float  #: degrees of freedom of it
    units: int  #: with a history
    over_years: tuple[float, float]  #: shortest and longest history
    fast_units: tuple[str, ...]  #: serial numbers of units that age otherwise than the type


@dataclass(frozen=True)
class _Slopes:
    serial_numbers: list[str]
    values: list[float]
    variances: list[float]
    years: list[float]


def ageing_of(units: Sequence[UnitCoefficients]) -> tuple[CoefficientAgeing, ...]:
    """Return the ageing of every coefficient that at least three units show.

    `units` are calibrations, several of each unit. Raises NotEnoughData where no coefficient has a history of three
    units.
    """
    histories: dict[str, list[UnitCoefficients]] = {}
    for unit in units:
        if unit.measured_at is not None:
            histories.setdefault(unit.serial_number, []).append(unit)
    several = {serial: own for serial, own in histories.items() if len(own) > 1}
    names = dict.fromkeys(name for own in several.values() for unit in own for name in unit.names)
    of_unit = {name: next((u.units[u.names.index(name)] for u in units if u.units and name in u.names), "")
               for name in names}  # fmt: skip
    ageings = []
    for name in names:
        slopes = _slopes(several, name)
        if len(slopes.values) >= MIN_UNITS:
            ageings.append(_ageing(name, of_unit[name], slopes))
    if not ageings:
        raise NotEnoughData(
            f"{counted(len(several), 'unit')} of the type {'was' if len(several) == 1 else 'were'} calibrated more "
            f"than once on known days; at least {MIN_UNITS} are needed: calibrate units of the type again"
        )
    return tuple(ageings)


def _slopes(histories: dict[str, list[UnitCoefficients]], name: str) -> _Slopes:
    """Return the change per year of a coefficient of each unit that has a history of it."""
    slopes = _Slopes([], [], [], [])
    for serial, every in histories.items():
        own = [unit for unit in every if name in unit.names]
        dates = [unit.measured_at for unit in own if unit.measured_at is not None]
        t = np.array([(date - dates[0]) / YEAR for date in dates])
        if len(t) < 2 or np.ptp(t) < MIN_YEARS:
            continue
        places = [unit.names.index(name) for unit in own]
        y = np.array([unit.values[i] for unit, i in zip(own, places, strict=True)])
        variance = np.array([unit.covariance[i, i] for unit, i in zip(own, places, strict=True)])
        if not (np.all(np.isfinite(y)) and np.all(np.isfinite(variance))):
            continue
        weight = 1.0 / np.maximum(variance, 1e-300)
        centred = t - np.average(t, weights=weight)
        information = float(weight @ centred**2)
        slopes.serial_numbers.append(serial)
        slopes.values.append(float((weight * centred) @ y) / information)
        slopes.variances.append(1.0 / information)
        slopes.years.append(float(np.ptp(t)))
    return slopes


def _ageing(name: str, unit_symbol: str, slopes: _Slopes) -> CoefficientAgeing:
    y, variance = np.array(slopes.values), np.array(slopes.variances)
    ones: NDArray[np.float64] = np.ones((len(y), 1))
    fitted, tau = robust_fit(y, variance, ones)
    z: Array = np.abs(y - fitted) / np.sqrt(variance + tau**2)
    kept = z <= FAR if int(np.sum(z <= FAR)) >= MIN_UNITS else np.ones(len(y), dtype=bool)
    spread = reml(y[kept], variance[kept], ones[kept])
    u_mean = float(np.sqrt(spread.covariance[0, 0]))
    return CoefficientAgeing(
        name, unit_symbol, float(spread.values[0]), u_mean, spread.tau, spread.low, spread.high,
        float(np.hypot(spread.tau, u_mean)), float(kept.sum() - 1), int(kept.sum()),
        (min(slopes.years), max(slopes.years)),
        tuple(serial for serial, is_kept in zip(slopes.serial_numbers, kept.tolist(), strict=True) if not is_kept),
    )  # fmt: skip
