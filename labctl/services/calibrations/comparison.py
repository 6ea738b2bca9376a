"""A calibration version as it is, beside a recording: measured and modelled error, and the model as lines on a grid.

Nothing is fitted here: points, lines, what remains and the error per turn all come from the version's own model.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.earth import up_rate_dps
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.levels import level_centres, rate_levels, temperature_rows
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.services.calibrations.model_lines import ModelLines, lines_over
from labctl.services.recordings.transfer import newest_row, points_of
from labctl.services.schemas.answers import ResponseModel
from labctl.store import Store
from labctl.turn_error import AT_REST_DPS, LEAST_RATE_DPS, bias_at_rest, turn_errors


class ComparisonColumns(ResponseModel):
    """One row per data set (or piece of a long one) and output axis, as lists of equal length."""

    dataset: list[int] = Field(default_factory=list)
    axis: list[str] = Field(default_factory=list, description="The output axis.")
    position: list[str] = Field(default_factory=list, description="The body axis that lay along the table axis.")
    table_rate_dps: list[float] = Field(default_factory=list)
    own_rate_dps: list[float] = Field(default_factory=list, description="True rate along the output axis.")
    temperature_c: list[float] = Field(default_factory=list)
    temperature_level_c: list[float] = Field(default_factory=list, description="Centre of its temperature level.")
    rate_level_dps: list[float] = Field(default_factory=list, description="Centre of its level of the table rate.")
    measured_error_dps: list[float] = Field(default_factory=list, description="Output minus own rate.")
    modelled_error_dps: list[float] = Field(default_factory=list, description="The version's model there.")
    residual_dps: list[float] = Field(default_factory=list, description="Measured minus modelled error.")
    turn_before_deg: list[float | None] = Field(
        default_factory=list,
        description="Error after a full turn with the static bias alone taken off; null: too slow, another axis turns, "
        "or the recording has nothing at rest.",
    )
    turn_after_deg: list[float | None] = Field(default_factory=list, description="The same after the calibration.")


class ComparisonResponse(ResponseModel):
    """A version applied as it is, and a recording."""

    serial: str
    version: int
    recording: int
    fitted_to: int | None = Field(description="The recording that the version was fitted to.")
    source: str = Field(description="Which model all numbers here come from, in words.")
    held: dict[str, float] = Field(description="Other channels that the lines need: their means in this recording.")
    left_out: list[dict[str, Any]] = Field(description="Effects of the fit that do not leave with the calibration.")
    least_turn_rate_dps: float = Field(description="The error per turn is given from this rate on.")
    at_rest_dps: float = Field(description="Below this table rate a data set is at rest.")
    columns: ComparisonColumns
    over_rate: list[ModelLines] = Field(description="A line over the table rate for each temperature level.")
    over_temperature: list[ModelLines] = Field(description="A line over temperature for each level of the table rate.")


def compare_version(store: Store, serial: str, version: int, recording: int | None) -> ComparisonResponse:
    """Return a version's model beside a recording. Raises NotFound, BadInput, NotEnoughData, NotConverged."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    measured = newest_row(store, serial, recording)
    calibration = read_calibration(row.document)
    data = fit_data_of(points_of(store, measured))
    if lacking := data.channels.missing(calibration.fitted.model.needs):
        raise BadInput(
            f"{serial} version {version} needs {', '.join(lacking)}, which recording {measured.id} does not have"
        )
    held = {
        name: float(np.mean(np.asarray(data.channels[name], dtype=np.float64)))
        for name in calibration.fitted.model.needs
    }
    over_rate, over_temperature = lines_over(calibration.fitted, data, held, up_rate_dps(data.info))
    return ComparisonResponse(
        serial=serial, version=version, recording=measured.id, fitted_to=row.recording,
        source=_source(calibration, row.recording, measured.id),
        held=held, left_out=list(calibration.document["left_out"]),
        least_turn_rate_dps=LEAST_RATE_DPS, at_rest_dps=AT_REST_DPS,
        columns=_columns(calibration, data), over_rate=over_rate, over_temperature=over_temperature,
    )  # fmt: skip


def _source(calibration: Calibration, fitted_to: int | None, recording: int) -> str:
    own = "which it was fitted to" if fitted_to == recording else "which it was not fitted to"
    return f"version {calibration.version} as it is, nothing refitted, beside recording {recording}, {own}"


def _columns(calibration: Calibration, data: FitData) -> ComparisonColumns:
    channels = data.channels
    position = np.asarray(channels["position"]).astype(np.str_)
    rate = channels.table_rate_dps()
    level = rate_levels(rate)
    modelled = errors_at_true_rates(calibration.fitted, channels)
    parts = [
        _axis(data, axis, modelled[axis], position, level_centres(rate, level), level)
        for axis in data.info.axes
        if axis in modelled
    ]
    names = ComparisonColumns.model_fields
    return ComparisonColumns(**{name: [value for part in parts for value in part[name]] for name in names})


def _axis(
    data: FitData, axis: str, modelled: Array, position: NDArray[np.str_], rate_level: Array, level: NDArray[np.int64]
) -> dict[str, list[Any]]:
    """Return the rows of one output axis."""
    channels = data.channels
    rate, own, warm = channels.table_rate_dps(), channels.rate_dps(axis), channels.temperature_c(axis)
    measured = data.outputs[axis] - own
    residual = measured - modelled
    own_turn = np.char.lstrip(position, "-") == axis
    before, after = (
        turn_errors(error - bias_at_rest(error, rate, warm, position), np.where(own_turn, rate, 0.0))
        for error in (measured, residual)
    )
    return {
        "dataset": np.asarray(channels["dataset"], dtype=np.int64).tolist(),
        "axis": [axis] * len(data),
        "position": position.tolist(),
        "table_rate_dps": rate.tolist(),
        "own_rate_dps": own.tolist(),
        "temperature_c": warm.tolist(),
        "temperature_level_c": level_centres(warm, temperature_rows(warm, position, level)).tolist(),
        "rate_level_dps": rate_level.tolist(),
        "measured_error_dps": measured.tolist(),
        "modelled_error_dps": modelled.tolist(),
        "residual_dps": residual.tolist(),
        "turn_before_deg": before,
        "turn_after_deg": after,
    }
