"""Coarse steps of the outputs, data set by data set, carried along with readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording.points import dataset_starts
from labctl.recording.quantisation import CODE_READINGS, QUANTISATION, figures_of, quantisation_std, steps_columns
from labctl.recording.recording import Recording

#: Readings of one piece of a long data set.
PIECE = CODE_READINGS


def with_quantisation(recording: Recording) -> Recording:
    """Return readings with a column `gyro_*_quantisation_std` for each output that comes in coarse steps.

    It has one value per data set: what the steps leave in its mean, in the output's unit. Readings that have the
    column keep it: those that were averaged do not show the steps any more.
    """
    columns = recording.columns
    dataset = np.asarray(columns["dataset"], dtype=np.int64)
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    valid_sets, starts = dataset[valid], dataset_starts(dataset[valid])
    quantised: dict[str, NDArray[np.generic]] = {}
    for name in (f"gyro_{axis}" for axis in recording.info.axes):
        if name + QUANTISATION not in columns and len(valid_sets):
            sets = np.split(np.asarray(columns[name], dtype=np.float64)[valid], starts[1:])
            for column, values in steps_columns(name, sets).items():
                quantised[column] = per_reading(dataset, valid_sets[starts], values)
    return replace(recording, columns={**columns, **quantised}) if quantised else recording


@dataclass(frozen=True)
class OutputStep:
    """Step in which an output comes, and what the steps leave in a mean, as a standard deviation."""

    step_dps: float
    left_dps: float  #: root mean square over the data sets


def output_steps(recording: Recording) -> dict[str, OutputStep]:
    """Return axis -> step of each output that comes in coarse steps, as the lattice of its readings shows it.

    Of means the lattice cannot be seen: nothing is said of them.
    """
    columns, steps = recording.columns, dict[str, OutputStep]()
    if recording.info.kind != "samples" or len(recording) == 0:
        return steps
    dataset = np.asarray(columns["dataset"], dtype=np.int64)
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    starts = dataset_starts(dataset[valid])
    for axis in recording.info.axes:
        values = np.asarray(columns[f"gyro_{axis}"], dtype=np.float64)[valid]
        step, deviation = quantisation_std(*figures_of(_pieces(values, starts)).T)
        if step is not None:
            output = recording.info.output.get(axis)
            scale = abs(output.scale) if output else 1.0
            steps[axis] = OutputStep(step / scale, float(np.sqrt(np.mean(deviation**2))) / scale)
    return steps


def _pieces(values: NDArray[np.float64], starts: NDArray[np.int64]) -> list[NDArray[np.float64]]:
    """Return the readings of each data set, a long one in pieces: over hours an output passes many codes."""
    pieces = []
    for part in np.split(values, starts[1:]):
        pieces += np.array_split(part, max(len(part) // PIECE, 1))
    return pieces


def quantisation_of(points: Recording) -> Mapping[str, NDArray[np.float64]]:
    """Return the columns of means that say what coarse steps leave in them."""
    return {name: np.asarray(v, dtype=np.float64) for name, v in points.columns.items() if name.endswith(QUANTISATION)}


def per_reading(
    dataset: NDArray[np.int64], numbers: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return values (m,) of the data sets of some numbers (m,) for readings (n,); 0 in data sets without one."""
    order = np.argsort(numbers, kind="stable")
    place = np.minimum(np.searchsorted(numbers[order], dataset), len(numbers) - 1)
    return np.where(numbers[order][place] == dataset, values[order][place], 0.0)
