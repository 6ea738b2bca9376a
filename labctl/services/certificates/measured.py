"""What was measured, as a certificate states it: dates, environment, results with U, errors before and after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labctl.answers.certificates import RoomConditions
from labctl.answers.fitted_model import Coefficients
from labctl.calibration import Calibration
from labctl.certificates.document import (
    AnyAxisResult,
    AxisError,
    CoefficientResult,
    Condition,
    Contribution,
    ResultPoint,
    StateOfItem,
    Uncertainty,
)
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY
from labctl.fitting.uncertainty.budget import Budget
from labctl.recording.recording import TEMPERATURES_OF_UNIT
from labctl.services.calibrations.surface import errors_on_grid
from labctl.services.calibrations.uncertainty import coefficients_at, over_any_axis, places_of, uncertainty_of
from labctl.services.certificates.missing import MissingFact
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_version import applied_errors, mounting_angles_of
from labctl.services.recordings.envelopes import envelope_of
from labctl.store import CalibrationRecord, RecordingRow, RoomSpan, Store

Array = NDArray[np.float64]
#: A coefficient is the quantity of a budget where both have this value, relative; the budget's is a derivative.
SAME_VALUE = 1e-6
#: Columns of a recording that are conditions, as a certificate names them, and their units.
CONDITIONS: Mapping[str, tuple[str, str]] = {
    "chamber_c": ("Temperature of the chamber air", "°C"),
    "reference_c": ("Temperature by the reference thermometer", "°C"),
    "temperature_c": ("Temperature of the item", "°C"),
    "own_temperature_c": ("Temperature by the item's own thermometer", "°C"),
    "humidity_pct": ("Relative humidity of the air", "%"),
    "supply_v": ("Supply voltage of the item", "V"),
}
#: Quantities of the room: name and unit of the condition, and what states it in an order.
ROOM: Mapping[str, tuple[str, str, str]] = {
    "temperature": ("Temperature of the room", "°C", "temperature_c"),
    "humidity": ("Relative humidity of the room", "%", "humidity_pct"),
    "pressure": ("Air pressure of the room", "hPa", "pressure_hpa"),
}


@dataclass(frozen=True)
class Results:
    """Error and U where U is known, and how many places there are where it is not, by part of U and reason."""

    points: tuple[ResultPoint, ...] = ()
    uncertainty: Uncertainty | None = None  #: where U is largest; None: there is no result
    unknown: Mapping[tuple[str, str], int] = field(default_factory=dict)
    axes_without: frozenset[str] = frozenset()
    any_axis: tuple[AnyAxisResult, ...] = ()

    def missing(self) -> Iterator[MissingFact]:
        """Yield the parts of U that are not known, where an axis has no result without them."""
        if self.axes_without:
            for part, why in self.unknown:
                yield MissingFact(f"uncertainty of the {part}", why)

    @property
    def left_out(self) -> tuple[str, ...]:
        """The sentences that name the places without a result."""
        return tuple(
            f"At {places} further rates and temperatures of the calibrated range no result is stated: the uncertainty "
            f"of the {part} is not known there ({why})."
            for (part, why), places in self.unknown.items()
        )


def environment_of_room(spans: Sequence[RoomSpan], ordered: RoomConditions) -> tuple[Condition, ...]:
    """Return the environment of the room: what was recorded while the campaign ran, else what the order states."""
    recorded = {each.quantity: (each.low, each.high) for each in spans}
    return tuple(
        Condition(name=name, unit=unit_symbol, low=limits[0], high=limits[1])
        for quantity, (name, unit_symbol, stated) in ROOM.items()
        if (limits := recorded.get(quantity) or getattr(ordered, stated)) is not None
    )


def environment(measurements: Measurements) -> tuple[Condition, ...]:
    """Return the least and the largest reading of each condition that was logged; of a recording of means, mean."""
    conditions = []
    for column, (name, unit_symbol) in CONDITIONS.items():
        ends = np.concatenate([_ends_of(measurements, row, column) for row in measurements.rows])
        if (ends := ends[np.isfinite(ends)]).size:
            conditions.append(Condition(name=name, unit=unit_symbol, low=float(ends.min()), high=float(ends.max())))
    return tuple(conditions)


def _ends_of(measurements: Measurements, row: RecordingRow, column: str) -> Array:
    """Return least and largest values of a condition of one recording, (n,), whatever their order; none without it.

    The temperature by which the item was fitted has one range: that of its readings, as the calibrated range has it.
    """
    columns = measurements.of_each[row.id].columns
    if column not in columns:
        return np.empty(0)
    means = np.asarray(columns[column], dtype=np.float64)
    if row.kind != "samples":
        return means
    if column == next((name for name in TEMPERATURES_OF_UNIT if name in columns), None):
        inspection = measurements.inspections[row.id]
        return np.array([*inspection.temperature_low_c, *inspection.temperature_high_c], dtype=np.float64)
    envelope = envelope_of(measurements.store, row.id, column)
    return np.concatenate([envelope.low, envelope.high]) if envelope.low.size else means


def results(store: Store, row: CalibrationRecord, calibration: Calibration) -> Results:
    """Return error and U over the calibrated range, at those places where U is known.

    Raises BadInput, NotEnoughData, NotConverged.
    """
    rates, temperatures = places_of(calibration)
    errors = errors_on_grid(store, row, rates, temperatures)
    has_temperature = bool(np.isfinite(calibration.temperature_c).all())
    points_and_budgets, unknown = list[tuple[ResultPoint, Budget]](), dict[tuple[str, str], int]()
    for i, temperature in enumerate(temperatures):
        for j, rate in enumerate(rates):
            for axis, u in uncertainty_of(calibration, rate, temperature).items():
                expanded, k = u.budget.expanded, u.budget.k
                if expanded is None or k is None:
                    for part in u.unknown.items():
                        unknown[part] = unknown.get(part, 0) + 1
                    continue
                point = ResultPoint(
                    axis=axis, temperature_c=temperature if has_temperature else None, rate_dps=rate,
                    error_dps=errors[axis][i][j], expanded_dps=expanded, k=k,
                )  # fmt: skip
                points_and_budgets.append((point, u.budget))
    points_and_budgets.sort(key=lambda each: calibration.axes.index(each[0].axis))
    points = tuple(point for point, _ in points_and_budgets)
    largest = max(points_and_budgets, key=lambda each: each[0].expanded_dps, default=None)
    without = frozenset(calibration.axes) - {point.axis for point in points}
    return Results(points, None if largest is None else _largest(*largest), unknown, without, _any_axis(calibration))


def _any_axis(calibration: Calibration) -> tuple[AnyAxisResult, ...]:
    """Return the largest U of each output where the item turns about any axis."""
    return tuple(
        AnyAxisResult(
            output=output, reach_dps=uncertainty.reach_dps, expanded_dps=uncertainty.bound_dps,
            aligned_expanded_dps=uncertainty.aligned_bound_dps,
            across=() if uncertainty.cross_rates is None else tuple(uncertainty.cross_rates["about"]),
            per_dps_across=None if uncertainty.cross_rates is None else uncertainty.cross_rates["per_dps"],
            why=uncertainty.why,
        )
        for output, uncertainty in over_any_axis(calibration).items()
    )  # fmt: skip


def _largest(point: ResultPoint, budget: Budget) -> Uncertainty:
    """Return the budget of a place, without the lines that add nothing."""
    lines = tuple(
        Contribution(
            source=line.source, type=line.kind, contribution_dps=abs(line.contribution) + abs(line.uncorrected),
            freedom=line.freedom,
        )
        for line in budget.lines
        if line.contribution
    )  # fmt: skip
    return Uncertainty(
        coverage_probability=COVERAGE_PROBABILITY, axis=point.axis, rate_dps=point.rate_dps,
        temperature_c=point.temperature_c, budget=lines,
    )  # fmt: skip


def coefficients(calibration: Calibration) -> tuple[CoefficientResult, ...]:
    """Return each coefficient with its standard uncertainty; of a temperature table at each of its nodes.

    It is that of the coefficient's budget, with the standards of the bench, for the bias at one temperature, the scale
    factor and the misalignments; of every other coefficient that of the fit alone.
    """
    tables: Mapping[str, Coefficients] = calibration.document["coefficients"]
    reference_c = calibration.fitted.model.reference.temperature_c
    budgets = _Budgets(calibration)
    results: list[CoefficientResult] = []
    for axis, table in tables.items():
        nodes = table.get("temperature_c")
        at = nodes if isinstance(nodes, list) else [None]
        for name, entry in table.items():
            if isinstance(entry, list):
                continue
            values, u = entry["value"], entry["u"]
            listed = values if isinstance(values, list) else [values]
            u_listed = u if isinstance(u, list) else [u]
            for where, value, of_fit in zip(at, listed, u_listed, strict=True):
                whole = budgets.u_of(axis, name, value, reference_c if where is None else where)
                results.append(
                    CoefficientResult(
                        axis=axis, name=name, temperature_c=where, value=value, unit=entry["unit"],
                        u=of_fit if whole is None else whole, has_standards=whole is not None,
                    )
                )  # fmt: skip
    return (*results, *_response(calibration))


def _response(calibration: Calibration) -> Iterator[CoefficientResult]:
    """Yield delay and time constant, by their budgets; a correction has none of them."""
    for axis, named in calibration.document.get("response", {}).items():
        for name, budget in named.items():
            if budget["value"] is not None:
                yield CoefficientResult(
                    axis=axis, name=name, temperature_c=None, value=budget["value"], unit=budget["unit"],
                    u=budget["combined"], has_standards=True,
                )  # fmt: skip


class _Budgets:
    """Budgets of a calibration's coefficients, at each temperature computed once."""

    def __init__(self, calibration: Calibration) -> None:
        self._calibration = calibration
        self._at: dict[float, dict[str, dict[str, Budget]]] = {}

    def u_of(self, axis: str, name: str, value: float, temperature_c: float) -> float | None:
        """Return the combined standard uncertainty of a coefficient; None where no budget is of this quantity."""
        if temperature_c not in self._at:
            try:
                self._at[temperature_c] = coefficients_at(self._calibration, temperature_c)
            except (BadInput, NotEnoughData):  # its model needs more, or its fit has no uncertainty
                self._at[temperature_c] = {}
        budget = self._at[temperature_c].get(axis, {}).get(name)
        same = budget is not None and np.isclose(budget.value or 0.0, value, rtol=SAME_VALUE, atol=SAME_VALUE**2)
        return budget.combined if budget is not None and same else None


def uncorrected(measured: Measurements, axes: tuple[str, ...]) -> StateOfItem:
    """Return the errors of the output by its nominal scale, nothing subtracted."""
    data = fit_data_of(measured.points)
    errors = {axis: np.asarray(data.outputs[axis] - data.true_rate_dps(axis), dtype=np.float64) for axis in axes}
    return _state("the output converted with its nominal scale factor, without correction", errors)


def corrected(measured: Measurements, calibration: Calibration, basis: str, fitted: Calibration) -> StateOfItem:
    """Return the errors of the rate corrected by a version; nothing is fitted.

    `fitted` is the version that was fitted to these measurements, which knows the angles of their mountings. Raises
    BadInput, NotEnoughData.
    """
    return _state(basis, applied_errors(calibration, measured.points, angles_rad=mounting_angles_of(fitted))[0])


def _state(basis: str, errors: Mapping[str, Array]) -> StateOfItem:
    return StateOfItem(
        basis=basis,
        datasets=max(len(values) for values in errors.values()),
        axes=tuple(
            AxisError(axis=axis, rms_dps=float(np.sqrt(np.mean(values**2))), max_dps=float(np.max(np.abs(values))))
            for axis, values in errors.items()
        ),
    )
