"""Coefficients of the calibrated units of a type, and the same side by side as arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.estimation.prior import coefficient_names
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array, block_diagonal

YEAR = timedelta(days=365.25)
#: What units are grouped by; the date of the measurement is a trend beside them.
FACTORS = ("batch", "bench", "supplier")


@dataclass(frozen=True)
class UnitCoefficients:
    """One calibrated unit: k coefficients with their covariance, and the groups that the unit belongs to."""

    serial_number: str
    names: tuple[str, ...]  #: (k,) such as `x.scale_factor`, see `unit_coefficients_of`
    values: Array  #: (k,)
    covariance: NDArray[np.float64]  #: (k, k)
    groups: Mapping[str, str | None] = field(default_factory=dict)  #: factor of `FACTORS` -> level; "" or None: unknown
    measured_at: datetime | None = None
    units: tuple[str, ...] = ()  #: (k,) of the coefficients, such as deg/s; (): not stated
    model: str = ""  #: error model and what its law is of; coefficients of two models are not compared
    reference_temperature_c: float | None = None  #: zero point of terms in temperature; None: it has no part in them


@dataclass(frozen=True)
class LeftOut:
    """A unit that is no part of a population, and why."""

    serial_number: str
    reason: str


@dataclass(frozen=True)
class UnitTable:
    """The n units of a type that have the same k coefficients."""

    serial_numbers: tuple[str, ...]
    names: tuple[str, ...]  #: (k,)
    units: tuple[str, ...]  #: (k,) of the coefficients; "": not stated
    values: NDArray[np.float64]  #: (n, k)
    covariance: NDArray[np.float64]  #: (n, k, k)
    levels: Mapping[str, tuple[str, ...]]  #: factor -> names of its levels
    level: Mapping[str, NDArray[np.int64]]  #: factor -> (n,) number of the level of each unit; -1: unknown
    years: Array  #: (n,) date of the measurement, years from the mean of all; NaN: unknown
    mean_date: datetime | None  #: None: no date is known
    reference_temperature_c: float | None  #: that the coefficients hold for; None: it has no part in them
    left_out: tuple[LeftOut, ...]

    def __len__(self) -> int:
        return len(self.serial_numbers)

    @property
    def variance(self) -> NDArray[np.float64]:
        """The variance of each coefficient of each unit by its own calibration, (n, k)."""
        return np.asarray(np.diagonal(self.covariance, axis1=1, axis2=2))


def unit_coefficients_of(
    fitted: FittedModel,
    serial_number: str,
    groups: Mapping[str, str | None] | None = None,
    measured_at: datetime | None = None,
) -> UnitCoefficients:
    """Return the coefficients of a fitted model that belong to the unit, those of all axes side by side.

    A coefficient is named `axis.name`, that of a temperature table `axis.name@temperature`, in deg C. Errors of
    different axes count as independent, apart from what each axis' own covariance says.
    """
    exported, _ = fitted.exported()
    names, units, values, blocks = [], [], [], []
    for axis, fit in exported.axes.items():
        every = coefficient_names(exported.model, axis, fit.effects, fit.names)
        kept = [i for i, name in enumerate(every) if name]
        names += [every[i] for i in kept]
        units += [fit.units[i // fit.values.shape[1]] for i in kept]
        values.append(fit.values.ravel()[kept])
        blocks.append(fit.covariance[np.ix_(kept, kept)])
    return UnitCoefficients(
        serial_number, tuple(names), np.concatenate([np.zeros(0), *values]), block_diagonal(blocks), groups or {},
        measured_at, tuple(units), f"{exported.model.name} of the {exported.model.argument}",
        None if isinstance(exported.model.temperature, LagrangeTable) else exported.model.reference.temperature_c,
    )  # fmt: skip


def unit_table(units: Sequence[UnitCoefficients]) -> UnitTable:
    """Return the units that have the coefficients which most of them have; the others are left out with the reason.

    The same coefficients are those of one model and one reference temperature, by name; a unit may have more of them.
    Of a unit that was calibrated more than once the newest calibration counts.
    """
    kinds = Counter((unit.model, unit.reference_temperature_c, frozenset(unit.names)) for unit in units)
    none = ("", None, frozenset[str]())
    wanted = max(kinds, key=lambda kind: (kinds[kind], len(kind[2]), kind[0])) if kinds else none
    names = next((unit.names for unit in units if frozenset(unit.names) == wanted[2]), ())
    left_out = [(unit, reason) for unit in units if (reason := _unusable(unit, *wanted))]
    refused = {id(unit) for unit, _ in left_out}
    newest: dict[str, UnitCoefficients] = {}
    for unit in units:
        if id(unit) not in refused and _is_newer(unit, newest.get(unit.serial_number)):
            newest[unit.serial_number] = unit
    rows = list(newest.values())
    places = {own: [own.index(name) for name in names] for own in {unit.names for unit in rows}}
    values = np.array([unit.values[places[unit.names]] for unit in rows]).reshape(len(rows), len(names))
    covariance = np.array([unit.covariance[np.ix_(places[unit.names], places[unit.names])] for unit in rows])
    levels, level = {}, {}
    for factor in FACTORS:
        levels[factor], level[factor] = _levels_of([unit.groups.get(factor) or "" for unit in rows])
    years, mean_date = _years_of(rows)
    first = next((unit for unit in rows if unit.units and unit.names == names), None)
    return UnitTable(
        tuple(newest), names, first.units if first else ("",) * len(names), values,
        covariance.reshape(len(rows), len(names), len(names)), levels, level, years, mean_date, wanted[1],
        tuple(LeftOut(unit.serial_number, reason) for unit, reason in left_out),
    )  # fmt: skip


def _unusable(unit: UnitCoefficients, model: str, reference_c: float | None, names: frozenset[str]) -> str:
    """Return why a unit is no part of a table of coefficients; "" for one that is."""
    missing = sorted(names - set(unit.names))
    if unit.model != model:
        return f"its calibration is by model {unit.model}, those of most units are by {model}"
    if missing:
        return f"its calibration has no coefficient {', '.join(missing)}, which most units of the type have"
    if unit.reference_temperature_c != reference_c:
        return (
            f"its coefficients hold for a reference temperature of {_degrees(unit.reference_temperature_c)}, those of "
            f"most units for {_degrees(reference_c)}"
        )
    if not (np.all(np.isfinite(unit.values)) and np.all(np.isfinite(unit.covariance))):
        return "its calibration states no value or no uncertainty of a coefficient"
    if np.any(np.diag(unit.covariance) < 0):
        return "its calibration states a negative variance of a coefficient"
    return ""


def _degrees(temperature_c: float | None) -> str:
    return "none" if temperature_c is None else f"{temperature_c:.4g} deg C"


def _is_newer(unit: UnitCoefficients, other: UnitCoefficients | None) -> bool:
    if other is None or other.measured_at is None:
        return True
    return unit.measured_at is not None and unit.measured_at >= other.measured_at


def _levels_of(names: list[str]) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Return the different names but "", and the number of the name of each unit, -1 for ""."""
    levels = tuple(sorted(set(names) - {""}))
    number = {name: i for i, name in enumerate(levels)} | {"": -1}
    return levels, np.array([number[name] for name in names], dtype=np.int64)


def _years_of(units: Sequence[UnitCoefficients]) -> tuple[Array, datetime | None]:
    """Return the dates in years from their mean, (n,), NaN for an unknown one, and the mean."""
    dates = [unit.measured_at for unit in units]
    known = [date for date in dates if date is not None]
    if not known:
        return np.full(len(dates), np.nan), None
    years = np.array([np.nan if date is None else (date - known[0]) / YEAR for date in dates])
    mean = float(np.nanmean(years))
    return years - mean, known[0] + mean * YEAR
