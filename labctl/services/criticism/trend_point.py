"""A point of a trend: what a version leaves of one recording, and the same computed again from every reading of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.answers.points import FigurePointResponse, TrendQuantity
from labctl.answers.units import AppliedVersion, TrendPoint
from labctl.errors import BadInput, NotFound
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.recording.points import to_points
from labctl.services.cache import UNNAMED, compute
from labctl.services.criticism.measurements import Measurements
from labctl.services.criticism.trend import Compared, compared_with
from labctl.services.recordings.figure_point import figure_number, figure_point
from labctl.store import RecordingRow, Store

#: Kept quantity -> name of the number that is drawn.
NAMES: Mapping[TrendQuantity, str] = {
    "bias": "bias left", "scale_factor": "scale factor left", "error": "RMS error over all axes",
    "as_found": "RMS error as found", "as_left": "RMS error as left",
}  # fmt: skip


@dataclass(frozen=True)
class FromReadings(Measurements):
    """Measurements whose means are computed from the readings: the kept ones are not used."""

    @cached_property
    def of_each(self) -> Mapping[int, Recording]:
        """The means of each recording, by its number."""
        kept = super().of_each
        return {row.id: _renewed(self.store, row, kept[row.id]) for row in self.rows}


def trend_point(
    store: Store, serial: str, version: int | None, recording: int, axis: str, quantity: TrendQuantity
) -> FigurePointResponse:  # fmt: skip
    """Return what a version (default: the unit's first) leaves of a recording, and what its readings give now.

    `quantity` is bias or scale_factor of an axis, or an error over all axes. Raises NotFound for a point that the trend
    does not have, BadInput for a recording that the version cannot be applied to.
    """
    compute(UNNAMED)
    compared = compared_with(store, serial, version)
    rows = [row for row in compared.measured if row.id == recording]
    if not rows:
        raise NotFound(f"the trend of {serial} has no recording {recording}; choose one of its points")
    (row,) = rows
    kept = Measurements(store, (row,))
    shown = compared.point(kept)
    drawn = _values(shown, axis, quantity)
    if drawn is None:
        why = shown.why or f"it has no {NAMES[quantity]} of axis {axis}"
        raise BadInput(f"recording {recording} has no such point in the trend: {why}; choose one of its points")
    has_readings = row.kind == "samples"
    if has_readings:
        report_stage(f"reading every reading of recording {recording}")
    measured = FromReadings(store, (row,)) if has_readings else kept
    again = _values(compared.point(measured), axis, quantity) if has_readings else None
    numbers = [
        figure_number(name, unit_symbol, value, again[name][0] if again else None)
        for name, (value, unit_symbol) in drawn.items()
    ]
    sets = [each.number for each in store.recordings.data_sets(recording) if each.state == "complete" and each.n]
    of, by = ("", "") if quantity in {"as_found", "as_left"} else (
        " of all axes" if quantity == "error" else f", axis {axis}", f", version {compared.reference.version}"
    )  # fmt: skip
    first, last = (min(sets), max(sets)) if sets else (0, 0)
    return figure_point(
        "trend", f"{NAMES[quantity]}{of}, recording {recording}{by}", recording, (first, last), numbers,
        _formula(compared, measured, axis, quantity), _output(store, row, axis) if has_readings else np.zeros(0),
    )  # fmt: skip


def _values(point: TrendPoint, axis: str, quantity: TrendQuantity) -> dict[str, tuple[float, str]] | None:
    """Return the numbers of a point by name, the drawn one first, each with its unit; None: it has none."""
    if quantity == "error":
        return None if point.rms_dps is None else {NAMES[quantity]: (point.rms_dps, "deg/s")}
    if quantity in {"as_found", "as_left"}:
        return _applied(NAMES[quantity], point.as_found if quantity == "as_found" else point.as_left)
    left = point.axes.get(axis)
    if left is None or (quantity == "scale_factor" and left.scale_factor is None):
        return None
    if quantity == "bias":
        return {NAMES[quantity]: (left.bias_dps, "deg/s"), "u of it": (left.u_bias_dps, "deg/s")}
    return {NAMES[quantity]: (left.scale_factor or 0.0, ""), "u of it": (left.u_scale_factor or 0.0, "")}


def _applied(name: str, applied: AppliedVersion | None) -> dict[str, tuple[float, str]] | None:
    if applied is None:
        return None
    return {
        name: (applied.rms_dps, "deg/s"),
        "largest error": (applied.max_dps, "deg/s"),
        "version": (float(applied.version), ""),
    }


def _formula(compared: Compared, measured: Measurements, axis: str, quantity: TrendQuantity) -> str:
    """Return how the drawn number follows from the errors of the data sets, with its numbers."""
    if quantity in {"as_found", "as_left"}:
        return "RMS error = sqrt(mean of (corrected rate - table rate)^2 over data sets and axes)"
    errors, rates_dps = compared.errors(measured)
    if quantity == "error":
        squares = np.concatenate(list(errors.values())) ** 2
        return (
            f"RMS error = sqrt(sum of squared errors / number) = sqrt({math.fsum(squares.tolist()):.9g} / "
            f"{len(squares)}) = {math.sqrt(float(squares.mean())):.9g} deg/s"
        )
    error, rate = errors[axis], rates_dps[axis]
    spread = float(np.sum((rate - rate.mean()) ** 2))
    slope = float(np.sum((rate - rate.mean()) * error)) / spread if spread > 0 else 0.0
    if quantity == "scale_factor":
        product = float(np.sum((rate - rate.mean()) * error))
        return (
            f"scale factor = sum of (rate - mean rate) x error / sum of (rate - mean rate)^2 = {product:.9g} / "
            f"{spread:.9g} = {slope:.9g}, over {len(error)} data sets"
        )
    return (
        f"bias = mean error - scale factor x mean rate = {error.mean():.9g} - {slope:.9g} x {rate.mean():.9g} = "
        f"{error.mean() - slope * rate.mean():.9g} deg/s, over {len(error)} data sets"
    )


def _renewed(store: Store, row: RecordingRow, kept: Recording) -> Recording:
    """Return the means of a recording with those of each data set computed from its readings.

    The pieces of a long data set, integrals of turns and readings of a profile are made of the readings already.
    """
    if kept.info.kind == "samples" or kept.info.motion in {"turns", "poses"}:
        return kept
    numbers = np.asarray(kept.columns["dataset"])
    columns = {name: np.array(values) for name, values in kept.columns.items()}
    info = kept.info.model_copy(update={"kind": "samples"})
    for dataset, readings in store.recordings.iter_datasets(row.id):
        place = np.flatnonzero(numbers == dataset)
        if len(place) != 1:
            continue
        for name, values in to_points(Recording(info, dict(readings))).columns.items():
            if name in columns and len(values) == 1:
                columns[name][place] = values
    return Recording(kept.info, columns, kept.environment)


def _output(store: Store, row: RecordingRow, axis: str) -> NDArray[np.float64]:
    """Return the valid readings of an output over all data sets, (n,) in its unit; of all where none is named."""
    names = (
        [f"gyro_{axis}"] if axis in row.recording_info.axes else [f"gyro_{each}" for each in row.recording_info.axes]
    )
    parts = [np.zeros(0)]
    for _, columns in store.recordings.iter_datasets(row.id):
        valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else slice(None)
        parts += [np.asarray(columns[name], dtype=np.float64)[valid] for name in names if name in columns]
    return np.concatenate(parts)
