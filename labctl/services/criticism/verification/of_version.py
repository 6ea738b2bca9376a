"""Verification: a calibration version applied without refitting to a recording; nothing is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration, read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.recording import Recording
from labctl.recording.verification import verification_part
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_poses import errors_in_poses
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.loading import motion_of, newest_row, source_of
from labctl.services.schemas.criticism import AxisVerification, VerificationResponse
from labctl.store import CalibrationRecord, Store

#: Largest ratio of the error found to the error expected of a version that holds: coverage factor of 95 %.
LARGEST_RATIO = 2.0


def verify_unit(
    store: Store, serial: str, version: int | None, recording: int | None, *, other_unit: bool = False
) -> VerificationResponse:
    """Apply a version (default: the newest) to a recording (default: the unit's newest).

    `other_unit` allows a recording of another unit. Raises NotFound, BadInput, NotEnoughData.
    """
    row = version_of(store, serial, version)
    measured = newest_row(store, serial, recording, other_unit=other_unit)
    return verify(store, row, Measurements(store, (measured,)))


def verify(store: Store, row: CalibrationRecord, measured: Measurements) -> VerificationResponse:
    """Apply a version to the means of a recording, as its consumer applies it to readings.

    Where a part of the recording was measured to verify, to that part. In poses to the readings: what gravity is off by
    after each turn, over how long the turn took.

    Raises BadInput where the recording lacks an axis or a channel of the model, NotEnoughData.
    """
    document, _ = store.calibrations.document(row.serial, row.version)
    calibration = read_calibration(document)
    aside = None
    if motion_of(measured.row) == "poses":
        pooled, errors, outside = errors_in_poses(calibration, source_of(store, measured.row))
    else:
        aside = verification_part(measured.points)
        errors, outside = applied_errors(calibration, measured.points if aside is None else aside)
        pooled = np.concatenate(list(errors.values()))
    rms, expected = _rms(pooled), expected_dps(row)
    return VerificationResponse(
        serial=row.serial,
        version=row.version,
        recording=measured.row.id,
        recorded_unit=measured.row.serial,
        seen=aside is None and measured.row.id in row.recordings,
        part="all" if aside is None else "verification",
        datasets=len(outside),
        rms_dps=rms,
        max_dps=float(np.max(np.abs(pooled))),
        bias_dps=float(np.mean(pooled)),
        axes={axis: _of_axis(values) for axis, values in errors.items()},
        outside_validity=int(np.count_nonzero(outside)),
        expected_dps=expected,
        ok=expected is not None and rms <= LARGEST_RATIO * expected,
    )


def applied_errors(
    calibration: Calibration, points: Recording, *, across_known: bool = True
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.bool_]]:
    """Return axis -> corrected minus true rate of each data set, (m,) deg/s, and which lie outside the validity, (m,).

    With `across_known` the table's rates about axes without an output enter the correction; a user does not have them.
    Raises BadInput where the recording lacks an axis or a channel of the model, NotEnoughData.
    """
    data = fit_data_of(points)
    missing = [axis for axis in calibration.axes if axis not in data.outputs]
    if missing:
        raise BadInput(
            f"{calibration.serial} version {calibration.version} corrects axes {', '.join(calibration.axes)}, "
            f"but the recording has no column gyro_{missing[0]}; name another recording"
        )
    compensator = Compensator(calibration)
    raw = np.column_stack([data.outputs[axis] for axis in calibration.axes])
    warm = np.column_stack([data.channels.temperature_c(axis) for axis in calibration.axes])
    found = compensator.compensate(
        raw, warm, _channels(compensator, data), history=data.channels.history,
        cross_rates_dps=(data.across_dps or None) if across_known else None,
    )  # fmt: skip
    errors = {axis: found.rate_dps[:, i] - data.true_rate_dps(axis) for i, axis in enumerate(calibration.axes)}
    return errors, found.outside


def _channels(compensator: Compensator, data: FitData) -> Mapping[str, NDArray[np.float64]]:
    absent = [name for name in compensator.needs if name not in data.channels]
    if absent:
        raise BadInput(
            f"the model needs channel {absent[0]!r}, which the recording does not have; name another recording"
        )
    needed = {name: np.asarray(data.channels[name], dtype=np.float64) for name in compensator.needs}
    if not compensator.remembers:
        return needed
    kept = {name: data.channels[name] for name in ("run", "temperature_c") if name in data.channels}
    return {**needed, **{name: np.asarray(values, dtype=np.float64) for name, values in kept.items()}}


def expected_dps(row: CalibrationRecord) -> float | None:
    """Return the error that a version promises for a data set, deg/s; None where it is unknown.

    It is the largest of its held-out errors and the error of its own data. A version of poses promises what its
    exported part leaves: without the sensitivity to specific force.
    """
    if "poses" in row.answer:
        return row.answer["poses"]["moves"]["applied_rms_dps"]
    error, joint = row.answer["error"], row.answer.get("joint")
    later = joint["heldout_rms_dps"] if joint else None  # of several recordings each was predicted by the others
    known = [figure for figure in (error["heldout_rms_dps"], error["rms_dps"], later) if figure is not None]
    return max(known, default=None)


def _of_axis(values: NDArray[np.float64]) -> AxisVerification:
    return AxisVerification(
        rms_dps=_rms(values), max_dps=float(np.max(np.abs(values))), bias_dps=float(np.mean(values))
    )


def _rms(values: NDArray[np.float64]) -> float:
    return math.sqrt(float(np.mean(values**2)))
