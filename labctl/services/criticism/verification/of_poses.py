"""Verification by poses: a version applied to readings, and gravity where the corrected rates put it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.fitting.poses.direction_errors import Correct, move_errors
from labctl.fitting.poses.readings import AXES, PoseReadings, readings_of
from labctl.recording import Recording

Array = NDArray[np.float64]
#: Temperature that a calibration without a law of temperature is given where the recording has no thermometer, deg C.
ANY_C = 25.0


def errors_in_poses(
    calibration: Calibration, recording: Recording
) -> tuple[Array, dict[str, Array], NDArray[np.bool_]]:
    """Return the errors of m turns, deg/s: all components that gravity shows, (2m,), axis -> (m,), and outside, (m,).

    Raises BadInput where version and recording do not fit, NotEnoughData for too few rests.
    """
    errors = move_errors(recording, correction_of(calibration, recording))
    axes = {str(axis): errors.by_axis_dps[:, i] for i, axis in enumerate(AXES)}
    return errors.rate_dps.ravel(), axes, errors.outside


def correction_of(calibration: Calibration, recording: Recording) -> Correct:
    """Return how a version corrects the readings of a recording in poses. Raises BadInput as `errors_in_poses`."""
    if set(calibration.axes) != set(AXES):
        raise BadInput(
            f"{calibration.serial} version {calibration.version} corrects only the axes "
            f"{', '.join(calibration.axes)}, but a turn by hand needs x, y and z; name a recording of another motion"
        )
    compensator = Compensator(calibration)
    readings = readings_of(recording)
    columns = [compensator.axes.index(axis) for axis in AXES]
    channels = _channels(compensator, recording)

    def correct(gyro_dps: Array) -> tuple[Array, NDArray[np.bool_]]:
        raw = np.empty_like(gyro_dps)
        raw[:, columns] = gyro_dps
        corrected = compensator.compensate(raw, _temperature(calibration, readings), channels)
        return corrected.rate_dps[:, columns], corrected.outside

    return correct


def _temperature(calibration: Calibration, readings: PoseReadings) -> Array:
    if readings.temperature_c is not None:
        return readings.temperature_c
    if np.isfinite(calibration.temperature_c[1]):
        raise BadInput(
            f"{calibration.serial} version {calibration.version} depends on the temperature, but the recording "
            "has no column temperature_c; add the column"
        )
    return np.full(len(readings), ANY_C)


def _channels(compensator: Compensator, recording: Recording) -> dict[str, Array]:
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    absent = [name for name in compensator.needs if name not in columns]
    if absent:
        raise BadInput(
            f"the model needs the channels {', '.join(absent)}, which the recording does not have; import the "
            "recording again with these columns, or name another recording"
        )
    return {name: np.asarray(columns[name], dtype=np.float64)[valid] for name in compensator.needs}
