"""A recording by what moved the unit: its outputs as they are, or corrected by a version without refitting."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.rate_profile import DELAY, TIME_CONSTANT, Response
from labctl.fitting.poses.direction_errors import Correct, move_errors
from labctl.fitting.uncertainty import COVERAGE
from labctl.json_types.budget import BudgetJson
from labctl.json_types.models import AxisCoefficients
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.by_motion.columns import picked, profile_columns, rest_columns, turn_columns
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_poses import correction_of
from labctl.services.criticism.verification.of_version import applied_errors
from labctl.services.recordings.loading import motion_of, newest_row, source_of
from labctl.services.schemas.comparison import AxisResponse, MotionResponse, PoseColumns
from labctl.store import CalibrationRecord, RecordingRow, Store


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
        axis: found
        for axis in coefficients
        if (found := _response(coefficients[axis], budgets.get(axis, {}))) is not None
    }
    return answer.model_copy(update={
        "profile": profile_columns(data, errors, {axis: response for axis, (response, _) in responses.items()}),
        "responses": {axis: figures for axis, (_, figures) in responses.items()},
        "rows": len(picked(len(data))), "of": len(data),
    })  # fmt: skip


def _source(row: RecordingRow, version: CalibrationRecord | None) -> str:
    if version is None:
        return f"uncorrected outputs of recording {row.id}"
    own = "which the version was fitted to" if row.id in version.recordings else "which the version was not fitted to"
    return f"version {version.version} without refitting, on recording {row.id}, {own}"


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
    found = axis["coefficients"].get(name)
    if found is None or isinstance(found, list):
        return None
    value, u = found["value"], found["u"]
    return None if isinstance(value, list) or isinstance(u, list) else (value, u)


def _in_poses(store: Store, row: RecordingRow, calibration: Calibration | None) -> dict[str, object]:
    recording = source_of(store, row)
    correct: Correct = _as_it_is if calibration is None else correction_of(calibration, recording)
    found = move_errors(recording, correct)
    columns = PoseColumns(
        from_s=found.t_s[:, 0].tolist(), until_s=found.t_s[:, 1].tolist(),
        accelerometer_deg=found.accelerometer_deg.tolist(), gyro_deg=found.gyro_deg.tolist(),
        residual_deg=found.residual_deg.tolist(),
    )  # fmt: skip
    return {
        "poses": columns, "rows": len(found.t_s), "of": len(found.t_s) + len(found.left_out),
        "left_out": list(found.left_out),
    }  # fmt: skip


def _as_it_is(gyro_dps: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    return gyro_dps, np.zeros(len(gyro_dps), dtype=np.bool_)
