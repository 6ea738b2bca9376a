"""A calibration version without refitting, beside a recording: measured and modelled error, and the model as lines
on a grid.

Nothing is fitted here: points, lines, what remains and the error per turn all come from the version's own model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.answers.comparison import ComparisonColumns, ComparisonResponse, ModelLines
from labctl.calibration import Calibration, read_calibration
from labctl.error_per_turn import AT_REST_DPS, MIN_RATE_DPS, bias_at_rest, turn_errors
from labctl.errors import BadInput, LabctlError
from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.earth_rate import turning_size_dps, up_rate_dps
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.levels import level_centres, rate_levels, temperature_rows
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.recording.positions import axis_in
from labctl.services.cache import cached_here
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.residuals import own_numbers
from labctl.services.criticism.verification.of_version import applied_errors
from labctl.services.recordings.loading import chosen_rows, readings_question
from labctl.store import Store

#: Points of a line, besides those at the measured rates or temperatures themselves.
POINTS = 61
#: Lines of one panel; of more levels these many, evenly picked.
MAX_LINES = 24
DIGITS = 8


def lines_over(
    fitted: FittedModel, data: FitData, held: Mapping[str, float], up_dps: float
) -> tuple[list[ModelLines], list[ModelLines]]:
    """Return the lines over the table rate and those over temperature, for each output axis and position measured.

    `held` are the other channels that the model needs; `up_dps` is the Earth's rate along the table axis.
    """
    channels = data.channels
    rate = channels.table_rate_dps()
    position = np.asarray(channels["position"]).astype(np.str_)
    level = rate_levels(rate)
    rates = np.unique(level_centres(rate, level))
    temperatures_of = {}
    for axis in (axis for axis in data.info.axes if axis in fitted.axes):
        temperatures_c = channels.temperature_c(axis)
        rows = temperature_rows(temperatures_c, position, level)
        temperatures_of[axis] = np.unique(level_centres(temperatures_c, rows))
    over_rate, over_temperature = [], []
    for up_axis in np.unique(position).tolist():
        for axis, temperatures in temperatures_of.items():

            def error(across: Array, down: Array, *, by_rate: bool, axis: str = axis, up_axis: str = up_axis) -> Any:
                grid = np.meshgrid(across, down)
                r, t = grid if by_rate else grid[::-1]
                return _rounded(_on_grid(fitted, axis, up_axis, r, t, held, up_dps))

            lines, at = _picked(temperatures), _along(rates)
            over_rate.append(ModelLines(
                axis=axis, position=up_axis, level=lines.tolist(), levels=len(temperatures), at=at.tolist(),
                error_dps=error(at, lines, by_rate=True),
            ))  # fmt: skip
            lines, at = _picked(rates, keep=0.0), _along(temperatures)
            over_temperature.append(ModelLines(
                axis=axis, position=up_axis, level=lines.tolist(), levels=len(rates), at=at.tolist(),
                error_dps=error(at, lines, by_rate=False),
            ))  # fmt: skip
    return over_rate, over_temperature


def _picked(levels: Array, keep: float | None = None) -> Array:
    """Return all levels, or of many some evenly picked ones, and that nearest to `keep`."""
    if len(levels) <= MAX_LINES:
        return levels
    rows = np.linspace(0, len(levels) - 1, MAX_LINES // 2).round().astype(np.int64)
    if keep is not None:
        rows = np.append(rows, np.argmin(np.abs(levels - keep)))
    return levels[np.unique(rows)]


def _along(measured: Array) -> Array:
    """Return where a line is drawn: finely, and at every measured level, so that no bend lies between two points."""
    chosen = _picked(measured)
    return np.unique(np.concatenate([np.linspace(measured[0], measured[-1], POINTS), chosen]))


def _on_grid(
    fitted: FittedModel, axis: str, position: str, rate: Array, temperature: Array, held: Mapping[str, float],
    up_dps: float,
) -> Array:  # fmt: skip
    """Return the error of an output axis, in the shape of the grids of table rate and temperature."""
    n = rate.size
    positions = np.full(n, position)
    columns: dict[str, Any] = {name: np.full(n, value) for name, value in held.items()}
    columns |= {"temperature_c": temperature.ravel(), "table_rate_dps": rate.ravel(), "position": positions}
    channels = Channels(columns, body_rates(rate.ravel() + up_dps, positions))
    return errors_at_true_rates(fitted, channels)[axis].reshape(rate.shape)


def _rounded(values: Array) -> list[list[float]]:
    return [[float(f"{value:.{DIGITS}g}") for value in row] for row in values.tolist()]


def compare_version(
    store: Store, serial: str, version: int, recording: int | None, *, recordings: Sequence[int] = (),
    other_unit: bool = False,
) -> ComparisonResponse:  # fmt: skip
    """Return a version's model beside a recording, or several; `other_unit` allows a recording of another unit.

    Raises NotFound, BadInput, NotEnoughData, NotConverged.
    """
    row = store.calibrations.get(store.units.get(serial).serial, version)
    measured = Measurements(store, chosen_rows(store, serial, recording, recordings, other_unit=other_unit))
    calibration = read_calibration(row.document)
    points = measured.points
    data, (errors, _) = fit_data_of(points), applied_errors(calibration, points)
    does = "does" if len(measured.rows) == 1 else "do"
    if lacking := data.channels.missing(calibration.fitted.model.needs):
        raise BadInput(
            f"version {version} of {serial} needs {', '.join(lacking)}, which {measured.named} {does} not have; "
            "name another recording"
        )
    held = {
        name: float(np.mean(np.asarray(data.channels[name], dtype=np.float64)))
        for name in calibration.fitted.model.needs
    }
    over_rate, over_temperature = lines_over(calibration.fitted, data, held, up_rate_dps(data.info))
    return ComparisonResponse(
        serial=serial, version=version, recording=measured.row.id, recordings=list(measured.recordings),
        fitted_to=row.recording, source=_source(calibration, row.recordings, measured),
        held=held, left_out=list(calibration.document["left_out"]),
        earth_turning_dps=turning_size_dps(data.info) or None,
        least_turn_rate_dps=MIN_RATE_DPS, at_rest_dps=AT_REST_DPS,
        columns=_columns(data, errors, measured.row.id), over_rate=over_rate, over_temperature=over_temperature,
    )  # fmt: skip


def comparison_of_version(
    store: Store, serial: str, version: int, recording: int | None, *, recordings: Sequence[int] = (),
    other_unit: bool = False,
) -> ComparisonResponse:  # fmt: skip
    """Return what `compare_version` returns, and raise the same; computed once for what the recordings hold now."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    rows = chosen_rows(store, serial, recording, recordings, other_unit=other_unit)
    question = {"compare": [row.serial, version, row.hash], **readings_question(store, rows)}

    def work() -> ComparisonResponse:
        return compare_version(store, serial, version, recording, recordings=recordings, other_unit=other_unit)

    return cached_here(ComparisonResponse, question, work)


def drawn_comparison(store: Store, serial: str, version: int, recording: int) -> ComparisonResponse | None:
    """Return what is drawn beside a criticism; None where the version cannot be applied to the recording."""
    try:
        return comparison_of_version(store, serial, version, recording, other_unit=True)
    except LabctlError:
        return None


def _source(calibration: Calibration, fitted_to: Sequence[int], measured: Measurements) -> str:
    fitted = "was fitted" if set(fitted_to) >= set(measured.recordings) else "was not fitted"
    fitted_text = f"which the version {fitted} to"
    if 0 < len(set(fitted_to) & set(measured.recordings)) < len(measured.recordings):
        fitted_text = (
            "of which the version was fitted to "
            f"{', '.join(map(str, sorted(set(fitted_to) & set(measured.recordings))))}"
        )
    return f"version {calibration.version} without refitting, on {measured.named}, {fitted_text}"


def _columns(data: FitData, errors: Mapping[str, Array], recording: int) -> ComparisonColumns:
    """Return the rows of all output axes; `errors` are axis -> (m,) corrected minus true rate, deg/s.

    `recording` is the number of a single recording.
    """
    position = np.asarray(data.channels["position"]).astype(np.str_)
    rate = data.channels.table_rate_dps()
    level = rate_levels(rate)
    numbers = own_numbers(data.channels, recording)
    parts = [numbers | _axis(data, axis, errors[axis], position, level_centres(rate, level), level) for axis in errors]
    columns = {name: [value for part in parts for value in part[name]] for name in ComparisonColumns.model_fields}
    return ComparisonColumns.model_validate(columns, extra="forbid")


def _axis(
    data: FitData, axis: str, residual: Array, position: NDArray[np.str_], rate_level: Array, level: NDArray[np.int64]
) -> dict[str, list[int] | list[str] | list[float] | list[float | None]]:
    """Return the rows of one output axis."""
    channels = data.channels
    rate, own_rate_dps, temperatures_c = (
        channels.table_rate_dps(),
        channels.rate_dps(axis),
        channels.temperature_c(axis),
    )
    measured = data.outputs[axis] - own_rate_dps
    own_turn = axis_in(position) == axis
    before, after = (
        turn_errors(error - bias_at_rest(error, rate, temperatures_c, position), np.where(own_turn, rate, 0.0))
        for error in (measured, residual)
    )
    return {
        "axis": [axis] * len(data),
        "position": position.tolist(),
        "table_rate_dps": rate.tolist(),
        "own_rate_dps": own_rate_dps.tolist(),
        "temperature_c": temperatures_c.tolist(),
        "temperature_level_c": level_centres(
            temperatures_c, temperature_rows(temperatures_c, position, level)
        ).tolist(),
        "rate_level_dps": rate_level.tolist(),
        "measured_error_dps": measured.tolist(),
        "modelled_error_dps": (measured - residual).tolist(),
        "residual_dps": residual.tolist(),
        "turn_before_deg": before,
        "turn_after_deg": after,
    }
