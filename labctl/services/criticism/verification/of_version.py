"""Verification: a calibration version applied without refitting to a recording; nothing is fitted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri, fdtri

from labctl.answers.fitted_model import AxisCoefficients
from labctl.answers.verification import AxisVerification, VerificationResponse
from labctl.calibration import Calibration, read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput, LabctlError
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import ANGLE_QUANTITIES, PLACED, leaning_rates, placed_rad, stated_rad
from labctl.recording import Recording
from labctl.recording.verification import fitted_part, verification_part
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_poses import errors_in_poses
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.loading import motion_of, newest_row, points_of, source_of
from labctl.store import CalibrationRecord, Store

# What a version promises of each axis, and how far an axis may be from it before it is said to be off.
#
# The expected error of a version is one figure over all axes. Of one axis it is that figure times the share of the
# axis in what the version leaves of its own data. An axis is off where the ratio of its RMS error to that is beyond a
# quantile of F, at a level shared by the axes (Sidak): of versions that hold, at most FALSE_ALARM have any axis that
# is off.

Array = NDArray[np.float64]
#: Largest share of recordings of versions that hold in which any axis is said to be off.
FALSE_ALARM = 0.05
#: Least limit of the error found over the error expected: coverage factor of 95 %.
LARGEST_RATIO = 2.0
#: Temperatures within this range are one level: the errors of their data sets are taken as one, K.
LEVEL_K = 5.0


@dataclass(frozen=True)
class OwnError:
    """What a version leaves of one axis of its own data: `rms_dps`, and its degrees of freedom."""

    rms_dps: float
    freedom: int


def own_errors(
    errors: Mapping[str, Sequence[Array]], coefficients: Mapping[str, AxisCoefficients]
) -> dict[str, OwnError]:
    """Return axis -> what a version leaves of its own data sets, (m,) deg/s of each of its recordings.

    It is {} where an axis has no more data sets than coefficients, or no error: one expectation then serves all axes.
    """
    by_axis = {}
    for axis, parts in errors.items():
        values = np.concatenate(list(parts))
        freedom = len(values) - _number(coefficients.get(axis))
        by_axis[axis] = OwnError(rms(values), freedom)
    return by_axis if all(each.freedom > 0 and each.rms_dps > 0 for each in by_axis.values()) else {}


def _number(axis: AxisCoefficients | None) -> int:
    """Return the number of coefficients of an axis; a table over the temperature has one at each of its nodes."""
    n = 0
    for name, entry in (axis["coefficients"] if axis is not None else {}).items():
        if name != "temperature_c" and isinstance(entry, dict):
            n += len(entry["value"]) if isinstance(entry["value"], list) else 1
    return n


def judged(
    errors: Mapping[str, Array],
    expected_dps: float | None,
    by_axis: Mapping[str, OwnError],
    groups: int,
    mounted_dps: Mapping[str, float] | None = None,
) -> dict[str, AxisVerification]:
    """Return the figures of each axis, (m,) deg/s, beside what is expected of it: `expected_dps` over all axes.

    `groups` is the number of parts of the recording whose errors are independent of each other; `mounted_dps`, by axis,
    what its mountings add, which are not those of the fit.
    """
    pooled = math.sqrt(sum(by_axis[axis].rms_dps ** 2 for axis in errors) / len(errors)) if by_axis else 0.0
    verifications = {}
    for axis, values in errors.items():
        size, expected, limit = rms(values), None, None
        if expected_dps is not None:
            expected = expected_dps * by_axis[axis].rms_dps / pooled if by_axis else expected_dps
            expected = math.hypot(expected, (mounted_dps or {}).get(axis, 0.0))
            limit = expected * largest_ratio(len(errors), groups, by_axis[axis].freedom if by_axis else None)
        verifications[axis] = AxisVerification(
            rms_dps=size, max_dps=float(np.max(np.abs(values))), bias_dps=float(np.mean(values)),
            expected_dps=expected, limit_dps=limit, ok=None if limit is None else size <= limit,
        )  # fmt: skip
    return verifications


def largest_ratio(axes: int, groups: int, freedom: int | None) -> float:
    """Return the largest ratio of the error found to the error expected of an axis that holds, one of `axes`.

    `groups` as in `judged`; `freedom`: degrees of freedom of the expected error, None where it is taken as exact.
    """
    level = 1 - (1 - FALSE_ALARM) ** (1 / axes)
    square = chdtri(groups, level) / groups if freedom is None else fdtri(groups, freedom, 1 - level)
    return max(LARGEST_RATIO, math.sqrt(float(square)))


def independent_groups(points: Recording) -> int:
    """Return the number of powered sessions times temperature levels of a recording, at least 1."""
    n = len(points)
    runs = np.asarray(points.columns.get("run", np.ones(n)))
    temperature_c = np.asarray(points.columns.get("temperature_c", np.zeros(n)), dtype=np.float64)
    n_groups = 0
    for run in np.unique(runs):
        reached = -np.inf
        for each in np.sort(temperature_c[runs == run]).tolist():
            if each > reached:
                n_groups, reached = n_groups + 1, each + LEVEL_K
    return max(n_groups, 1)


def rms(values: Array) -> float:
    """Return the root mean square."""
    return math.sqrt(float(np.mean(values**2)))


#: Output -> name -> angle of a mounting, rad.
Angles = Mapping[str, Mapping[str, float]]
__all__ = ["LARGEST_RATIO", "Left", "applied_errors", "expected_dps", "left_by", "verify", "verify_unit"]


@dataclass(frozen=True)
class Left:
    """What a version leaves of a recording: errors over all axes, (k,) deg/s, and axis -> those of the axis, (m,)."""

    pooled: NDArray[np.float64]
    errors: dict[str, NDArray[np.float64]]
    outside: NDArray[np.bool_]  #: which data sets lie outside the validity, (m,)
    is_part: bool  #: whether of the data sets that were measured to verify
    groups: int  #: parts whose errors are independent of each other
    mounted_dps: Mapping[str, float] = field(default_factory=dict)  #: axis -> what the mountings add, root mean square

    @property
    def part(self) -> Literal["all", "verification"]:
        """Which data sets these are."""
        return "verification" if self.is_part else "all"

    @property
    def rms_dps(self) -> float:
        """Root mean square over data sets and axes."""
        return rms(self.pooled)

    @property
    def max_dps(self) -> float:
        """Largest size."""
        return float(np.max(np.abs(self.pooled)))

    @property
    def bias_dps(self) -> float:
        """Mean over data sets and axes."""
        return float(np.mean(self.pooled))


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
    """Apply a version to a recording and compare each axis with what the version promises of it.

    Raises BadInput, NotEnoughData as `left_by`.
    """
    errors_left, expected = left_by(store, row, measured), expected_dps(row)
    by_axis = (
        _own_errors(store, row, measured, errors_left) if expected is not None and len(errors_left.errors) > 1 else {}
    )
    axes = judged(errors_left.errors, expected, by_axis, errors_left.groups, errors_left.mounted_dps)
    return VerificationResponse(
        serial=row.serial,
        version=row.version,
        recording=measured.row.id,
        recorded_unit=measured.row.serial,
        seen=not errors_left.is_part and measured.row.id in row.recordings,
        part=errors_left.part,
        datasets=len(errors_left.outside),
        rms_dps=errors_left.rms_dps,
        max_dps=errors_left.max_dps,
        bias_dps=errors_left.bias_dps,
        axes=axes,
        axes_off=[axis for axis, axis_errors in axes.items() if axis_errors.ok is False],
        outside_validity=int(np.count_nonzero(errors_left.outside)),
        expected_dps=expected,
        ok=all(axis_errors.ok is True for axis_errors in axes.values()),
    )


def left_by(store: Store, row: CalibrationRecord, measured: Measurements) -> Left:
    """Apply a version to the means of a recording, as its consumer applies it to readings.

    Where a part of the recording was measured to verify, to that part. In poses to the readings: what gravity is off by
    after each turn, over how long the turn took.

    Raises BadInput where the recording lacks an axis or a channel of the model, NotEnoughData.
    """
    document, _ = store.calibrations.document(row.serial, row.version)
    calibration = read_calibration(document)
    if motion_of(measured.row) == "poses":
        pooled, errors, outside = errors_in_poses(calibration, source_of(store, measured.row))
        return Left(pooled, errors, outside, is_part=False, groups=1)
    aside = verification_part(measured.points)
    points = measured.points if aside is None else aside
    is_fitted = measured.row.id in row.recordings
    angles = mounting_angles_of(calibration, anew=aside is not None) if is_fitted else None
    errors, outside = applied_errors(calibration, points, angles_rad=angles)
    pooled = np.concatenate(list(errors.values()))
    mounted = (
        _mounted_dps(calibration, fit_data_of(points), is_fitted=is_fitted)
        if aside is not None or not is_fitted
        else {}
    )
    return Left(pooled, errors, outside, aside is not None, independent_groups(points), mounted)


def _own_errors(store: Store, row: CalibrationRecord, measured: Measurements, left: Left) -> dict[str, OwnError]:
    """Return what a version leaves of each axis of its own recordings; {} where that is not known."""
    calibration = read_calibration(row.document)
    parts: dict[str, list[NDArray[np.float64]]] = {}
    try:
        for number in row.recordings:
            head = store.recordings.get(number)
            if number == measured.row.id and not left.is_part:
                errors = left.errors
            elif motion_of(head) == "poses":
                _, errors, _ = errors_in_poses(calibration, source_of(store, head))
            else:
                angles = mounting_angles_of(calibration)
                errors, _ = applied_errors(calibration, fitted_part(points_of(store, head)), angles_rad=angles)
            for axis, values in errors.items():
                parts.setdefault(axis, []).append(values)
    except LabctlError:  # a table of coefficients, say
        return {}
    return own_errors(parts, row.answer["axes"]) if set(parts) == set(left.errors) else {}


def applied_errors(
    calibration: Calibration,
    points: Recording,
    *,
    across_known: bool = True,
    angles_rad: Angles | None = None,
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.bool_]]:
    """Return axis -> corrected minus true rate of each data set, (m,) deg/s, and which lie outside the validity, (m,).

    With `across_known` the table's rates about axes without an output enter the correction; a user does not have them.
    `angles_rad` are those of the mountings of this recording, as far as a fit separated them: the true rates are then
    those of a unit that leans so. Without them the mountings count as nominal, and what fixture and table are off by is
    in the errors.
    Raises BadInput where the recording lacks an axis or a channel of the model, NotEnoughData.
    """
    data = fit_data_of(points)
    if angles_rad:
        data = replace(data, channels=data.channels.with_rates(leaning_rates(data.channels, angles_rad)))
    missing = [axis for axis in calibration.axes if axis not in data.outputs]
    if missing:
        raise BadInput(
            f"{calibration.serial} version {calibration.version} corrects axes {', '.join(calibration.axes)}, "
            f"but the recording has no column gyro_{missing[0]}; name another recording"
        )
    compensator = Compensator(calibration)
    raw = np.column_stack([data.outputs[axis] for axis in calibration.axes])
    temperature_c = np.column_stack([data.channels.temperature_c(axis) for axis in calibration.axes])
    corrected = compensator.compensate(
        raw, temperature_c, _channels(compensator, data), history=data.channels.history,
        cross_rates_dps=(data.across_dps or None) if across_known else None,
    )  # fmt: skip
    errors = {axis: corrected.rate_dps[:, i] - data.true_rate_dps(axis) for i, axis in enumerate(calibration.axes)}
    return errors, corrected.outside


def _mounted_dps(calibration: Calibration, data: FitData, *, is_fitted: bool) -> dict[str, float]:
    """Return axis -> what mountings that are not those of the fit add to its errors, root mean square, deg/s.

    The unit was placed anew. On another day the angles of fixture and table are in the errors of a version that is
    free of them.
    """
    standards = () if calibration.bench is None else calibration.bench.standards
    of_bench = not is_fitted and bool(mounting_angles_of(calibration))
    u_rad = stated_rad(standards, ANGLE_QUANTITIES) if of_bench else placed_rad(standards)
    table_dps = data.channels.table_rate_dps()
    across = {axis: np.where(data.channels.up(axis) == 0, table_dps, 0.0) for axis in calibration.axes}
    return {axis: u_rad * rms(values) for axis, values in across.items()}


def mounting_angles_of(calibration: Calibration, *, anew: bool = False) -> Angles:
    """Return output -> name -> angle of the mountings of the recording that a version was fitted to, rad.

    With `anew` without what is different whenever the unit is mounted: for a part in mountings of its own.
    """
    angles = {} if calibration.bench is None else calibration.bench.angles_rad
    return {
        axis: {name: angle for name, angle in named.items() if not (anew and name.endswith(PLACED))}
        for axis, named in angles.items()
    }


def _channels(compensator: Compensator, data: FitData) -> Mapping[str, NDArray[np.float64]]:
    absent = [name for name in compensator.needs if name not in data.channels]
    if absent:
        raise BadInput(
            f"the model needs channel {absent[0]!r}, which the recording does not have; name another recording"
        )
    needed = {name: np.asarray(data.channels[name], dtype=np.float64) for name in compensator.needs}
    if not compensator.remembers:
        return needed
    channels = {name: data.channels[name] for name in ("run", "temperature_c") if name in data.channels}
    return {**needed, **{name: np.asarray(values, dtype=np.float64) for name, values in channels.items()}}


def expected_dps(row: CalibrationRecord) -> float | None:
    """Return the error that a version promises for a data set, deg/s; None where it is unknown.

    It is the largest of its held-out errors and the error of its own data. A version of poses promises what its
    exported part leaves: without the sensitivity to specific force.
    """
    if "poses" in row.answer:
        return row.answer["poses"]["moves"]["applied_rms_dps"]
    error, joint = row.answer["error"], row.answer.get("joint")
    later = joint["heldout_rms_dps"] if joint else None  # of several recordings each was predicted by the others
    errors_dps = [figure for figure in (error["heldout_rms_dps"], error["rms_dps"], later) if figure is not None]
    return max(errors_dps, default=None)
