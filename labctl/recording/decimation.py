"""Readings averaged down to the rate that criticism needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording import Recording
from labctl.recording.columns import OWN_DATASET, RECORDING, VERIFICATION
from labctl.recording.points import dataset_starts

#: Faster readings are averaged down to this many per second.
FASTEST_HZ = 10.0


def decimated_columns(
    recording: Recording,
) -> tuple[dict[str, NDArray[np.float64]], NDArray[np.int64], dict[str, NDArray[np.generic]]]:
    """Return valid readings averaged down to `FASTEST_HZ`: numbers by column (output in deg/s), data sets, texts."""
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    dataset = np.asarray(columns["dataset"], dtype=np.int64)[valid]
    numbers = {
        name: np.asarray(values, dtype=np.float64)[valid]
        for name, values in columns.items()
        if name not in {"valid", "dataset"} and values.dtype.kind in "fiu"
    }
    texts = {name: np.asarray(v)[valid] for name, v in columns.items() if v.dtype.kind not in "fiu"}
    for axis in recording.info.axes:
        numbers[f"gyro_{axis}"] = recording.gyro_dps(axis)[valid]
    starts = dataset_starts(dataset)
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64))
    spacing = float(np.median(np.diff(t_s[: min(len(t_s), 5000)]))) if len(t_s) > 1 else 0.1
    every = max(round(1.0 / (FASTEST_HZ * max(spacing, 1e-6))), 1)
    if every > 1:
        ordinal = np.arange(len(dataset)) - np.repeat(starts, np.diff(np.append(starts, len(dataset))))
        blocks = dataset_starts(dataset * (int(ordinal.max()) // every + 2) + ordinal // every)
        counts = np.diff(np.append(blocks, len(dataset)))
        numbers = {name: np.add.reduceat(values, blocks) / counts for name, values in numbers.items()}
        texts = {name: values[blocks] for name, values in texts.items()}
        dataset = dataset[blocks]
    return numbers, dataset, texts


def decimate(recording: Recording) -> Recording:
    """Return a recording's valid readings averaged down to `FASTEST_HZ`, output in the recording's own unit."""
    numbers, dataset, texts = decimated_columns(recording)
    for axis in recording.info.axes:
        output_unit = recording.info.output.get(axis)
        if output_unit is not None:
            numbers[f"gyro_{axis}"] = output_unit.offset + output_unit.scale * numbers[f"gyro_{axis}"]
    for name in ("run", "mounting", VERIFICATION, RECORDING, OWN_DATASET):
        if name in numbers:
            texts[name] = np.rint(numbers.pop(name)).astype(np.int64)
    return Recording(recording.info, {"dataset": dataset, **numbers, **texts}, recording.environment)
