"""Residuals of a model, data set by data set, with the measured and the modelled error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from labctl.answers.residuals import ResidualColumns
from labctl.fitting import FitResult
from labctl.fitting.criticism import ReducedRecording, Residuals
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.numeric.arrays import Array, over
from labctl.recording import Recording
from labctl.recording.columns import OWN_DATASET, RECORDING


def residual_columns(
    data: ReducedRecording, left: Mapping[str, Residuals], points: Recording, recording: int,
    base: FitResult | None = None,
) -> ResidualColumns:  # fmt: skip
    """Return the residuals of a criticism as columns, axis by axis; `recording` is the number of a single recording.

    Where there was too little for a verdict (`left` is empty) they are those of `base`, a fit to the points.
    """
    if not left:
        return _of_fit(points, recording, base) if base is not None else ResidualColumns()
    nodes, first = data.nodes, np.arange(len(data)) * (len(data.nodes) // len(data))
    shared = _shared(nodes.take(first), data.dataset, points, recording) | {
        "table_rate_dps": data.at_sets(nodes.table_rate_dps()).tolist(),
        "t_s": data.at_sets(np.asarray(nodes["t_s"], dtype=np.float64)).tolist() if "t_s" in nodes else None,
    }
    means = _means_of(points, data)
    columns = []
    for axis, residuals in left.items():
        temperature_c = data.at_sets(nodes.temperature_c(axis))
        if means is not None:  # the residual is that of the means
            true, output = means.true_rate_dps(axis), means.outputs[axis]
        else:
            true, output = data.rows_of(nodes.rate_dps(axis)[:, None])[0, :, 0], data.output[axis][0]
        measured = output - true
        columns.append(_axis(axis, shared, true, temperature_c, measured, residuals.means, residuals.floor_dps))
    return _joined(columns)


def _means_of(points: Recording, data: ReducedRecording) -> FitData | None:
    """Return the means of the rows of a reduced recording; None where it is divided in another way.

    The first coordinate of a reduced data set is no mean: it leaves out what drifts or turns within the set.
    """
    means = fit_data_of(points)
    numbers = np.asarray(means.channels["dataset"], dtype=np.int64)
    return means if np.array_equal(numbers, np.asarray(data.dataset, dtype=np.int64)) else None


def _of_fit(points: Recording, recording: int, base: FitResult) -> ResidualColumns:
    context = fit_data_of(points)
    floor = base.error.noise_floor_dps
    channels = context.channels
    dataset = np.asarray(channels["dataset"], dtype=np.int64)
    shared = _shared(channels, dataset, points, recording) | {
        "table_rate_dps": channels.table_rate_dps().tolist(),
        "t_s": np.asarray(channels["t_s"]).tolist() if "t_s" in channels else None,
    }
    columns = []
    for axis, residual in base.residual_dps.items():
        true = context.true_rate_dps(axis)
        floors = np.full(len(context), floor) if floor else None
        temperature_c, measured = channels.temperature_c(axis), context.outputs[axis] - true
        columns.append(_axis(axis, shared, true, temperature_c, measured, residual, floors))
    return _joined(columns)


def _shared(sets: Channels, dataset: np.ndarray, points: Recording, recording: int) -> dict[str, Any]:
    """Return what the rows of all axes have in common; `sets` has one row per data set."""
    set_numbers: dict[int, int] = {}
    if "n" in points.columns:
        set_numbers = dict(
            zip(np.asarray(points.columns["dataset"]).tolist(), np.asarray(points.columns["n"]).tolist(), strict=True)
        )
    single = {"recording": [recording] * len(dataset), "dataset": dataset.tolist()}
    return {
        **(own_numbers(sets, recording) if RECORDING in sets else single),
        "position": [str(position) for position in sets["position"]],
        "run": np.rint(sets["run"]).astype(int).tolist() if "run" in sets else [1] * len(dataset),
        "n": [set_numbers.get(number) for number in dataset.tolist()],
    }


def own_numbers(sets: Channels, recording: int) -> dict[str, list[int]]:
    """Return `recording` and `dataset` of each row: of several recordings as one, or of the single one `recording`."""

    def numbers(name: str) -> list[int]:
        return [int(number) for number in np.rint(np.asarray(sets[name], dtype=np.float64))]

    if RECORDING in sets:
        return {"recording": numbers(RECORDING), "dataset": numbers(OWN_DATASET)}
    return {"recording": [recording] * len(sets), "dataset": numbers("dataset")}


def _axis(
    axis: str, shared: Mapping[str, Any], true: Array, temperatures_c: Array, measured: Array, residual: Array,
    floor: Array | None,
) -> dict[str, list[Any]]:  # fmt: skip
    m = len(residual)
    unknown: list[Any] = [None] * m
    return {
        **{name: values if values is not None else unknown for name, values in shared.items()},
        "axis": [axis] * m,
        "own_rate_dps": true.tolist(),
        "temperature_c": temperatures_c.tolist(),
        "measured_error_dps": measured.tolist(),
        "modelled_error_dps": (measured - residual).tolist(),
        "residual_dps": residual.tolist(),
        "floor_dps": unknown if floor is None else floor.tolist(),
        "over_floor": unknown if floor is None else over(residual, floor).tolist(),
    }


def _joined(parts: list[dict[str, list[Any]]]) -> ResidualColumns:
    return ResidualColumns(**{name: [value for part in parts for value in part[name]] for name in parts[0]})
