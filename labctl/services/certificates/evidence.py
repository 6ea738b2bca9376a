"""What a statement of conformity rests on: errors that were measured to verify, or those that the fit has seen."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from labctl.calibration import Calibration
from labctl.certificates.document import Evidence, StateOfItem, Use
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.uncertainty.budget import Budget
from labctl.recording.verification import verification_part
from labctl.services.calibrations.uncertainty import budgets_at
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_version import applied_errors


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
    """The errors that are compared with a limit."""

    evidence: Evidence
    largest_dps: float
    datasets: int
    verified: tuple[VerifiedError, ...] = ()  #: of a verification part, one by one


def errors_of(measured: Measurements, calibration: Calibration, left: StateOfItem, about: Use) -> Errors:
    """Return the errors of a verification part, or of what was fitted where the recordings have none.

    About the own axis the errors of an output are those of the data sets that turned about its axis, or about none.
    Data sets outside the range of the calibration are no evidence for it. Raises BadInput, NotEnoughData.
    """
    parts = [part for each in measured.of_each.values() if (part := verification_part(each)) is not None]
    found: list[VerifiedError] = []
    datasets = 0
    for part in parts:
        errors, outside = applied_errors(calibration, part)
        data = fit_data_of(part)
        datasets += int((~outside).sum())
        for row in (~outside).nonzero()[0].tolist():
            found += _at(data, row, {axis: float(values[row]) for axis, values in errors.items()}, calibration, about)
    if not found:
        return Errors("fitted", max(axis.max_dps for axis in left.axes), left.datasets)
    return Errors("verification", max(abs(each.error_dps) for each in found), datasets, tuple(found))


def _at(
    data: FitData, row: int, errors_dps: dict[str, float], calibration: Calibration, about: Use
) -> Iterator[VerifiedError]:
    """Yield the error of each output at one data set, as far as it belongs to the use."""
    rates = {axis: float(data.true_rate_dps(axis)[row]) for axis in BODY_AXES}
    turned = {axis for axis in BODY_AXES if data.channels.table_rate_dps()[row] and data.channels.up(axis)[row]}
    knows = math.isfinite(calibration.temperature_c[0])
    for axis, error in errors_dps.items():
        if about == "own axis" and not turned <= {axis}:
            continue
        warm = float(data.channels.temperature_c(axis)[row])
        budget = budgets_at(calibration, rates if about == "any axis" else rates[axis], warm)[axis]
        yield VerifiedError(axis, (rates["x"], rates["y"], rates["z"]), warm if knows else None, error, budget)
