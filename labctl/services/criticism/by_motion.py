"""A recording by what moved the unit: its outputs as they are, or corrected by a version without refitting."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.answers.budget import BudgetJson
from labctl.answers.comparison import (
    AxisResponse,
    MotionResponse,
    PoseColumns,
    ProfileColumns,
    RestColumns,
    TurnColumns,
)
from labctl.answers.fitted_model import AxisCoefficients
from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.response import DELAY, TIME_CONSTANT, Response
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.direction_errors import Correct, move_errors
from labctl.fitting.uncertainty import COVERAGE
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_poses import correction_of
from labctl.services.criticism.verification.of_version import applied_errors
from labctl.services.recordings.loading import motion_of, newest_row, source_of
from labctl.store import CalibrationRecord, RecordingRow, Store

#: Rows of one axis that a picture of a profile takes.
MAX_ROWS = 6000
#: axis -> (m,) corrected minus true rate, deg/s; None without a version.
Errors = Mapping[str, Array] | None
_Rows = dict[str, list[Any]]
LEGS = {1: "heating", -1: "cooling", 0: ""}


def rest_columns(data: FitData, errors: Errors) -> RestColumns:
    """Return the data sets at rest, axis by axis, in order of time."""
    channels, m = data.channels, len(data)
    t_s, thermometer = channels.columns.get("t_s"), channels.history.thermometer
    run = np.asarray(channels["run"], dtype=np.int64) if "run" in channels else np.ones(m, dtype=np.int64)
    legs = np.sign(legs_of(data.temperature_c, run)) if thermometer and t_s is not None else np.zeros(m, dtype=np.int64)

    def of(axis: str) -> _Rows:
        bias, residual = data.outputs[axis] - data.true_rate_dps(axis), _left(errors, axis)
        return {
            "axis": [axis] * m,
            "dataset": _dataset(data),
            "t_s": _optional(t_s, m),
            "temperature_c": _optional(channels.temperature_c(axis) if thermometer else None, m),
            "leg": [LEGS[int(leg)] for leg in legs],
            "bias_dps": bias.tolist(),
            "u_dps": _optional(None if data.white_var is None else np.sqrt(data.white_var[axis]), m),
            "modelled_dps": _optional(None if residual is None else bias - residual, m),
            "residual_dps": _optional(residual, m),
        }

    return RestColumns(**_joined(data, errors, of))


def turn_columns(data: FitData, errors: Errors) -> TurnColumns:
    """Return the turns, axis by axis; rests between them are left out."""
    rows = np.flatnonzero(data.channels.table_rate_dps() != 0)
    m, duration_s = len(rows), data.channels.durations_s()[rows]
    about = np.asarray(data.channels["position"]).astype(np.str_)[rows].tolist()

    def of(axis: str) -> _Rows:
        residual, true = _left(errors, axis), data.true_rate_dps(axis)[rows]
        residual = None if residual is None else residual[rows]
        u_dps = None if data.white_var is None else np.sqrt(data.white_var[axis][rows])
        return {
            "axis": [axis] * m,
            "dataset": np.asarray(_dataset(data))[rows].tolist(),
            "about": about,
            "asked_deg": (true * duration_s).tolist(),
            "output_deg": (data.outputs[axis][rows] * duration_s).tolist(),
            "corrected_deg": _optional(None if residual is None else (true + residual) * duration_s, m),
            "residual_deg": _optional(None if residual is None else residual * duration_s, m),
            "u_deg": _optional(None if u_dps is None else u_dps * duration_s, m),
        }

    return TurnColumns(**_joined(data, errors, of))


def profile_columns(data: FitData, errors: Errors, responses: Mapping[str, Response]) -> ProfileColumns:
    """Return the windows of a profile, axis by axis, at most `MAX_ROWS` of each; `responses` are a version's."""
    rows = picked(len(data))
    m = len(rows)

    def of(axis: str) -> _Rows:
        residual, true, followed = _left(errors, axis), data.true_rate_dps(axis), None
        if residual is not None and axis in responses:
            followed = (true + residual - data.through(responses[axis]).true_rate_dps(axis))[rows]
        return {
            "axis": [axis] * m,
            "dataset": np.asarray(_dataset(data))[rows].tolist(),
            "t_s": np.asarray(data.channels["t_s"], dtype=np.float64)[rows].tolist(),
            "true_dps": true[rows].tolist(),
            "output_dps": data.outputs[axis][rows].tolist(),
            "residual_dps": _optional(None if residual is None else residual[rows], m),
            "followed_dps": _optional(followed, m),
        }

    return ProfileColumns(**_joined(data, errors, of))


def _joined(data: FitData, errors: Errors, of: Callable[[str], _Rows]) -> _Rows:
    """Return the columns of all axes one below the other."""
    parts = [of(axis) for axis in data.info.axes if errors is None or axis in errors]
    return {name: [value for part in parts for value in part[name]] for name in parts[0]} if parts else {}


def picked(n: int) -> NDArray[np.int64]:
    """Return the rows that are drawn: all of n, or `MAX_ROWS` of them evenly."""
    return np.unique(np.linspace(0, n - 1, min(n, MAX_ROWS)).round().astype(np.int64))


def _left(errors: Errors, axis: str) -> Array | None:
    return None if errors is None else errors[axis]


def _dataset(data: FitData) -> list[int]:
    return [int(number) for number in np.rint(np.asarray(data.channels["dataset"], dtype=np.float64))]


def _optional(values: NDArray[np.generic] | None, n: int) -> list[float | None]:
    if values is None:
        return [None] * n
    numbers = np.asarray(values, dtype=np.float64).tolist()
    return [value if np.isfinite(value) else None for value in numbers]


def recording_by_motion(store: Store, recording: int) -> MotionResponse:
    """Return a recording at rest, in turns, of a profile or in poses, uncorrected. Raises NotFound, BadInput."""
    return _compared(store, newest_row(store, store.recordings.get(recording).serial, recording), None)


def version_by_motion(
    store: Store, serial: str, version: int, recording: int | None, *, other_unit: bool = False
) -> MotionResponse:
    """Return the same corrected by a version; `other_unit` allows a recording of another unit.

    Raises NotFound, BadInput for a recording at constant rates, NotEnoughData.
    """
    calibration = store.calibrations.get(store.units.get(serial).serial, version)
    return _compared(store, newest_row(store, serial, recording, other_unit=other_unit), calibration)


def _compared(store: Store, row: RecordingRow, version: CalibrationRecord | None) -> MotionResponse:
    motion = motion_of(row)
    if motion == "rates" or row.kind == "coefficients":
        raise BadInput(
            f"recording {row.id} has one rate in each data set (motion = {motion!r}); request its comparison "
            "with a version instead"
        )
    compute(UNNAMED)
    calibration = None if version is None else read_calibration(version.document)
    answer = MotionResponse.model_validate({
        "serial": row.serial, "recording": row.id, "version": version and version.version, "motion": motion,
        "source": _source(row, version), "rows": 0, "of": 0,
    })  # fmt: skip
    if motion == "poses":
        return answer.model_copy(update=_in_poses(store, row, calibration))
    points = Measurements(store, (row,)).points
    data = fit_data_of(points)
    errors = None if calibration is None else applied_errors(calibration, points)[0]
    if motion == "rest":
        return answer.model_copy(update={"rest": rest_columns(data, errors), "rows": len(data), "of": len(data)})
    if motion == "turns":
        turns = int(np.count_nonzero(data.channels.table_rate_dps()))
        return answer.model_copy(update={"turns": turn_columns(data, errors), "rows": turns, "of": turns})
    coefficients: Mapping[str, AxisCoefficients] = {} if version is None else version.answer["axes"]
    budgets = {} if calibration is None else calibration.document.get("response", {})
    responses = {
        axis: axis_response
        for axis in coefficients
        if (axis_response := _response(coefficients[axis], budgets.get(axis, {}))) is not None
    }
    return answer.model_copy(update={
        "profile": profile_columns(data, errors, {axis: response for axis, (response, _) in responses.items()}),
        "responses": {axis: figures for axis, (_, figures) in responses.items()},
        "rows": len(picked(len(data))), "of": len(data),
    })  # fmt: skip


def _source(row: RecordingRow, version: CalibrationRecord | None) -> str:
    if version is None:
        return f"uncorrected outputs of recording {row.id}"
    fitted_text = (
        "which the version was fitted to" if row.id in version.recordings else "which the version was not fitted to"
    )
    return f"version {version.version} without refitting, on recording {row.id}, {fitted_text}"


def _response(axis: AxisCoefficients, budgets: Mapping[str, BudgetJson]) -> tuple[Response, AxisResponse] | None:
    """Return delay and bandwidth of an axis as a response and as figures; None where a model has neither.

    Expanded uncertainties are those of the budgets; a version that has none, by an older version of labctl, has 2 u.
    """
    delay, constant = (_single(axis, name) for name in (DELAY, TIME_CONSTANT))
    if delay is None and constant is None:
        return None
    delay_s, u_delay_s = delay or (None, None)
    tau_s, u_tau_s = constant or (0.0, None)
    hz = 1 / (2 * math.pi * tau_s) if tau_s > 0 else None
    u_hz = None if hz is None or u_tau_s is None else hz * u_tau_s / tau_s
    expanded_tau_s = _expanded(budgets.get(TIME_CONSTANT), u_tau_s)
    figures = AxisResponse(
        delay_s=delay_s, u_delay_s=u_delay_s, bandwidth_hz=hz, u_bandwidth_hz=u_hz,
        expanded_delay_s=_expanded(budgets.get(DELAY), u_delay_s),
        expanded_bandwidth_hz=None if hz is None or expanded_tau_s is None else hz * expanded_tau_s / tau_s,
    )  # fmt: skip
    return Response(delay_s or 0.0, tau_s), figures


def _expanded(budget: BudgetJson | None, u: float | None) -> float | None:
    if budget is not None:
        return budget["expanded"]
    return None if u is None else COVERAGE * u


def _single(axis: AxisCoefficients, name: str) -> tuple[float, float | None] | None:
    """Return a coefficient and its standard uncertainty; None where the model has none of this name."""
    coefficient = axis["coefficients"].get(name)
    if coefficient is None or isinstance(coefficient, list):
        return None
    value, u = coefficient["value"], coefficient["u"]
    return None if isinstance(value, list) or isinstance(u, list) else (value, u)


def _in_poses(store: Store, row: RecordingRow, calibration: Calibration | None) -> dict[str, object]:
    recording = source_of(store, row)
    correct: Correct = _as_it_is if calibration is None else correction_of(calibration, recording)
    errors = move_errors(recording, correct)
    columns = PoseColumns(
        from_s=errors.t_s[:, 0].tolist(), until_s=errors.t_s[:, 1].tolist(),
        accelerometer_deg=errors.accelerometer_deg.tolist(), gyro_deg=errors.gyro_deg.tolist(),
        residual_deg=errors.residual_deg.tolist(),
    )  # fmt: skip
    return {
        "poses": columns, "rows": len(errors.t_s), "of": len(errors.t_s) + len(errors.left_out),
        "left_out": list(errors.left_out),
    }  # fmt: skip


def _as_it_is(gyro_dps: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    return gyro_dps, np.zeros(len(gyro_dps), dtype=np.bool_)
