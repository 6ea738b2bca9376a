"""What a statement of conformity rests on: errors that were measured to verify, and those that the fit has seen."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from labctl.answers.certificates import Use
from labctl.calibration import Calibration
from labctl.certificates.document import Evidence
from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import placed_rad
from labctl.fitting.uncertainty.budget import Budget, BudgetLine, budget_of
from labctl.recording import Recording
from labctl.recording.verification import fitted_part, verification_part
from labctl.services.calibrations.uncertainty import budgets_at
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_version import applied_errors, mounting_angles_of

#: A verification has to reach into this share of the range of rates at either end.
END_SHARE = 1.0 / 3.0


class NotVerified(BadInput):
    """A verification part is there, but does not cover what a statement is to hold for; nothing was written."""


@dataclass(frozen=True)
class VerifiedError:
    """The error of one corrected output at a rate vector and temperature that the fit has not seen."""

    output: str
    rates_dps: tuple[float, float, float]  #: true rate about x, y and z
    temperature_c: float | None  #: None: the calibration knows no temperature
    error_dps: float
    budget: Budget  #: of the corrected rate there


@dataclass(frozen=True)
class Errors:
    """The errors that are compared with a limit: of a verification part, and of what was fitted."""

    fitted_dps: float  #: the largest error of the data sets that were fitted
    fitted_datasets: int
    verified: tuple[VerifiedError, ...] = ()
    verified_datasets: int = 0
    is_anew: bool = False  #: whether the verification has mountings and powered sessions of its own

    @property
    def evidence(self) -> Evidence:
        """What a statement rests on."""
        return "verification" if self.verified else "fitted"

    @property
    def datasets(self) -> int:
        """How many data sets that are."""
        return self.verified_datasets if self.verified else self.fitted_datasets

    @property
    def largest_dps(self) -> float:
        """The largest error of all: what the fit has seen is in the range too."""
        return max([self.fitted_dps, *(abs(each.error_dps) for each in self.verified)])


@dataclass(frozen=True)
class _Part:
    """Data sets of one recording, with the errors that a user has there."""

    data: FitData
    errors_dps: Mapping[str, np.ndarray]
    outside: np.ndarray

    @staticmethod
    def of(calibration: Calibration, points: Recording, *, anew: bool = False) -> _Part:
        """Correct without the rates about axes that have no output, which a user does not know."""
        angles = mounting_angles_of(calibration, anew=anew)
        errors, outside = applied_errors(calibration, points, across_known=False, angles_rad=angles)
        return _Part(fit_data_of(points), errors, outside)

    def belongs(self, row: int, axis: str, about: Use) -> bool:
        """Return whether a data set shows an error of an output in a use."""
        if about == "any axis" or not self.data.channels.table_rate_dps()[row]:
            return True
        return bool(self.data.channels.up(axis)[row])

    def _with_placement(self, budget: Budget, row: int, axis: str, calibration: Calibration) -> Budget:
        """Return the budget of an error with how the unit was placed anew for it: across, a part of the rate."""
        channels = self.data.channels
        across = 0.0 if channels.up(axis)[row] else abs(float(channels.table_rate_dps()[row]))
        u_rad = 0.0 if calibration.bench is None else placed_rad(calibration.bench.standards)
        if budget.combined is None or not across * u_rad:
            return budget
        line = BudgetLine(
            "mounting_repeatability", "mounting_repeatability (of the mounting that verifies)", "B", "normal",
            math.degrees(u_rad), "deg", math.radians(across), across * u_rad,
        )  # fmt: skip
        return budget_of(budget.result, budget.unit, [*budget.lines, line], budget.value)

    def largest(self, about: Use) -> list[float]:
        """Return the largest error of each data set that shows one."""
        rows = [
            [abs(float(values[row])) for axis, values in self.errors_dps.items() if self.belongs(row, axis, about)]
            for row in range(len(self.data))
        ]
        return [max(row) for row in rows if row]

    def at(self, row: int, calibration: Calibration, about: Use) -> Iterator[VerifiedError]:
        """Yield the error of each output at one data set, as far as it belongs to the use."""
        rates = {axis: float(self.data.true_rate_dps(axis)[row]) for axis in BODY_AXES}
        knows = math.isfinite(calibration.temperature_c[0])
        for axis, values in self.errors_dps.items():
            if self.belongs(row, axis, about):
                temperature_c = float(self.data.channels.temperature_c(axis)[row])
                budget = budgets_at(calibration, rates if about == "any axis" else rates[axis], temperature_c)[axis]
                budget = self._with_placement(budget, row, axis, calibration)
                place = (rates["x"], rates["y"], rates["z"])
                yield VerifiedError(axis, place, temperature_c if knows else None, float(values[row]), budget)


def errors_of(measured: Measurements, calibration: Calibration, about: Use) -> Errors:
    """Return the errors of the rates that a user has, of what was fitted and of a verification part.

    About the own axis the errors of an output are those of the data sets that turned about its axis, or about none.
    Raises NotVerified where a verification part does not cover the use; BadInput, NotEnoughData.
    """
    recordings = list(measured.of_each.values())
    fitted = [
        error for recording in recordings for error in _Part.of(calibration, fitted_part(recording)).largest(about)
    ]
    aside = [(recording, part) for recording in recordings if (part := verification_part(recording)) is not None]
    errors: list[VerifiedError] = []
    datasets = outside = 0
    for _, points in aside:
        part_seen = _Part.of(calibration, points, anew=True)
        outside += int(part_seen.outside.sum())
        for row in np.flatnonzero(~part_seen.outside).tolist():
            shown_errors = list(part_seen.at(row, calibration, about))
            errors += shown_errors
            datasets += bool(shown_errors)
    if aside:
        _require_cover(errors, calibration, about, outside)
    is_anew = bool(aside) and all(_is_anew(whole_recording, part) for whole_recording, part in aside)
    return Errors(max(fitted, default=0.0), len(fitted), tuple(errors), datasets, is_anew)


def _is_anew(whole: Recording, part: Recording) -> bool:
    """Return whether the data sets that verify share no mounting and no powered session with those that were fitted."""
    fitted_rest = fitted_part(whole)
    return all(
        name in part.columns and not set(part.columns[name].tolist()) & set(fitted_rest.columns[name].tolist())
        for name in ("run", "mounting")
    )


def _require_cover(verified: Sequence[VerifiedError], calibration: Calibration, about: Use, outside: int) -> None:
    """Raise NotVerified unless each output was turned near both ends of the range, about each axis of the use."""
    low, high = calibration.rate_dps
    if not math.isfinite(high - low):
        low, high = 0.0, 0.0
    third = END_SHARE * (high - low)
    for output in calibration.axes:
        for place, turning in enumerate(BODY_AXES):
            if about == "own axis" and turning != output:
                continue
            rates = [each.rates_dps[place] for each in verified if each.output == output]
            if rates and min(rates) <= low + third + 1e-9 and max(rates) >= high - third - 1e-9:
                continue
            text = f"at {min(rates):.4g} to {max(rates):.4g} deg/s" if rates else "at no rate"
            beyond = f" ({outside} data sets lie beyond the range of the calibration)" if outside else ""
            raise NotVerified(
                f"output {output} was verified about {turning} {text}{beyond}; a statement about {about} for {low:.4g} "
                f"to {high:.4g} deg/s needs rates in the outer thirds of this range. Verify there ([verification] of "
                "the recipe), or leave [conformity] out of the order"
            )
