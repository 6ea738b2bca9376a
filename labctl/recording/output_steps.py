"""Coarse steps of the outputs, data set by data set, carried along with readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording.points import dataset_starts
from labctl.recording.quantisation import QUANTISATION, steps_columns
from labctl.recording.recording import Recording


def with_quantisation(recording: Recording) -> Recording:
    """Return readings with a column `gyro_*_quantisation_std` for each output that comes in coarse steps.

    It has one value per data set: what the steps leave in its mean, in the output's unit. Readings that have the
    column keep it: those that were averaged do not show the steps any more.
    """
    columns = recording.columns
    dataset = np.asarray(columns["dataset"], dtype=np.int64)
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    known, starts = dataset[valid], dataset_starts(dataset[valid])
    found: dict[str, NDArray[np.generic]] = {}
    for name in (f"gyro_{axis}" for axis in recording.info.axes):
        if name + QUANTISATION not in columns and len(known):
            sets = np.split(np.asarray(columns[name], dtype=np.float64)[valid], starts[1:])
            for column, values in steps_columns(name, sets).items():
                found[column] = per_reading(dataset, known[starts], values)
    return replace(recording, columns={**columns, **found}) if found else recording


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
