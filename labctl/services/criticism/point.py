"""From a point of a figure to the bytes: its readings, its numbers, and the same computed again from the readings."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.answers.points import PointFigure, PointNumbers, PointResponse
from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotFound
from labctl.fitting.data.fit_data import fit_data_of
from labctl.recording import Recording
from labctl.recording.points import to_points
from labctl.services.criticism.comparison import compare_version
from labctl.services.criticism.criticise import residuals_unit
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.verification.of_version import applied_errors
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.loading import chosen_rows
from labctl.store import RecordingRow, Store

#: Rounding of a mean, as a share of the output or of 1 deg/s: sums in another order differ by some 1e-16 of it each.
ROUNDING = 1e-12
Readings = Mapping[str, NDArray[np.generic]]


def point_unit(
    store: Store, serial: str, version: int, recording: int, dataset: int, axis: str, figure: PointFigure = "residual",
    recordings: Sequence[int] = (),
) -> PointResponse:  # fmt: skip
    """Return a point of a figure of a version and recording, or of several `recordings` that are drawn together.

    Raises NotFound for a point that the figure does not have, BadInput for a data set that is drawn in pieces.
    """
    shown = _shown(store, serial, version, recording, dataset, axis, figure, recordings)
    rounding_dps = ROUNDING * max(1.0, abs(shown.output_dps))
    row = next(each for each in chosen_rows(store, serial, None, (recording,)) if each.id == recording)
    readings = store.recordings.dataset(recording, dataset) if row.kind == "samples" else {}
    recomputed, difference = None, None
    if readings:
        recomputed = _recomputed(store, serial, version, row, dataset, axis, figure, readings, shown)
        difference = max(abs(now - then) for now, then in zip(_values(recomputed), _values(shown), strict=True))
    valid, output = _valid(readings, axis)
    equal = None if difference is None else difference <= rounding_dps
    return PointResponse(
        serial=serial, version=version, recording=recording, dataset=dataset, axis=axis, figure=figure, shown=shown,
        recomputed=recomputed, equal=equal, largest_difference_dps=difference, rounding_dps=rounding_dps,
        readings=len(output), invalid=int(np.sum(~valid)),
        std_dps=float(np.std(output, ddof=1)) if len(output) > 1 else None,
        readings_sha256=hashlib.sha256(output.astype("<f8").tobytes()).hexdigest() if len(output) else None,
        formula=_formula(shown), summary=_summary(recording, len(output), equal, difference, rounding_dps),
    )  # fmt: skip


def _shown(
    store: Store, serial: str, version: int, recording: int, dataset: int, axis: str, figure: PointFigure,
    recordings: Sequence[int],
) -> PointNumbers:  # fmt: skip
    """Return the numbers of the figure, as its answer gives them."""
    several = tuple(recordings)
    single = None if several else recording
    columns = (
        residuals_unit(store, serial, version, single, several).columns
        if figure == "residual"
        else compare_version(store, serial, version, single, recordings=several).columns
    )
    places = zip(columns.recording, columns.dataset, columns.axis, strict=True)
    rows = [k for k, place in enumerate(places) if place == (recording, dataset, axis)]
    if not rows:
        raise NotFound(
            f"the figure {figure} of {serial} version {version} has no data set {dataset} of recording {recording} on "
            f"axis {axis}; choose one of its points"
        )
    if len(rows) > 1:
        raise BadInput(
            f"data set {dataset} of recording {recording} is drawn in {len(rows)} pieces; open the recording to see "
            "its readings"
        )
    (k,) = rows
    rate, error = columns.own_rate_dps[k], columns.measured_error_dps[k]
    return PointNumbers(
        output_dps=rate + error, own_rate_dps=rate, measured_error_dps=error,
        modelled_error_dps=columns.modelled_error_dps[k], residual_dps=columns.residual_dps[k],
    )  # fmt: skip


def _recomputed(
    store: Store, serial: str, version: int, row: RecordingRow, dataset: int, axis: str, figure: PointFigure,
    readings: Readings, shown: PointNumbers,
) -> PointNumbers:  # fmt: skip
    """Return the numbers from raw readings: the kept means of this data set are not used."""
    kept = Measurements(store, (row,)).points
    place = np.flatnonzero(np.asarray(kept.columns["dataset"]) == dataset)
    means = to_points(Recording(kept.info.model_copy(update={"kind": "samples"}), dict(readings)))
    columns = {name: np.array(values) for name, values in kept.columns.items()}
    for name, values in means.columns.items():
        if name in columns:
            columns[name][place] = values
    points = Recording(kept.info, columns, kept.environment)
    data = fit_data_of(points)
    (k,) = np.flatnonzero(np.asarray(data.channels["dataset"]) == dataset)
    output, rate = float(data.outputs[axis][k]), float(data.channels.rate_dps(axis)[k])
    if figure == "residual":
        modelled = shown.modelled_error_dps
        residual = output - rate - modelled
    else:
        calibration = read_calibration(version_of(store, serial, version).document)
        residual = float(applied_errors(calibration, points)[0][axis][k])
        modelled = output - rate - residual
    return PointNumbers(
        output_dps=output, own_rate_dps=rate, measured_error_dps=output - rate, modelled_error_dps=modelled,
        residual_dps=residual,
    )  # fmt: skip


def _valid(readings: Readings, axis: str) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which readings are valid, (n,), and the valid ones of the output, (m,) in its unit."""
    name = f"gyro_{axis}"
    if name not in readings:
        return np.zeros(0, dtype=bool), np.zeros(0)
    output = np.asarray(readings[name], dtype=np.float64)
    valid = np.asarray(readings["valid"]) != 0 if "valid" in readings else np.ones(len(output), dtype=bool)
    return valid, output[valid]


def _values(numbers: PointNumbers) -> list[float]:
    return [float(value) for value in numbers.model_dump().values()]


def _formula(shown: PointNumbers) -> str:
    return (
        f"residual = output - rate - modelled error = {shown.output_dps:.9g} - "
        f"{_subtrahend(shown.own_rate_dps)} - {_subtrahend(shown.modelled_error_dps)} = {shown.residual_dps:.6g} deg/s"
    )


def _summary(recording: int, readings: int, equal: bool | None, difference: float | None, rounding_dps: float) -> str:
    if equal is None or difference is None:
        return f"Recording {recording} has means of data sets and no readings, so nothing was computed again."
    if equal:
        return f"Recomputed from {readings} raw readings: equal."
    return (
        f"Recomputed from {readings} raw readings: not equal, the difference is {difference:.2g} deg/s, the rounding "
        f"{rounding_dps:.2g} deg/s."
    )


def _subtrahend(value: float) -> str:
    """Return a number behind a minus sign; a negative one in brackets."""
    return f"({value:.9g})" if value < 0 else f"{value:.9g}"
