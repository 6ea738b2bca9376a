"""Reduction of a recording of single readings."""

from __future__ import annotations

import numpy as np

from labctl.fitting.criticism.reduction.basis import WAVES, orthonormal_basis
from labctl.fitting.criticism.reduction.decimation import FASTEST_HZ, decimated_columns
from labctl.fitting.criticism.reduction.nodes import nodes_of
from labctl.fitting.criticism.reduction.outliers import inlier_mask, white_level_dps
from labctl.fitting.criticism.reduction.padding import pad, piece_labels
from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.recording import Recording


def reduce_samples(recording: Recording, *, outliers: bool) -> ReducedRecording:
    """Return the coordinates of every data set; without `outliers` every valid reading counts."""
    numbers, dataset, texts = decimated_columns(recording)
    padded = pad(piece_labels({"dataset": dataset, **numbers}))
    m = len(padded.there)
    begin = padded.index[:, 0]
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64) / FASTEST_HZ)
    since = padded.of(t_s - t_s[begin].repeat(padded.there.sum(axis=1).astype(int)))
    angle = np.deg2rad(padded.of(numbers["table_angle_deg"])) if "table_angle_deg" in numbers else None
    axes: tuple[str, ...] = recording.info.axes
    outputs = {axis: padded.of(numbers[f"gyro_{axis}"]) for axis in axes}
    there = padded.there
    for axis in axes if outliers else ():
        there = there * inlier_mask(outputs[axis], padded.there)
    # the lines of the steps need the angle turned, from any origin: both of their waves are removed
    turned = angle if angle is not None else np.deg2rad(padded.of(numbers["table_rate_dps"])) * since
    basis, present = orthonormal_basis(there, since, turned, angle)
    count = np.maximum(there.sum(axis=1), 1.0)
    basis /= np.sqrt(count)[None, :, None]
    nodes, weights = nodes_of(recording, numbers, texts, padded, there, since, basis)
    waves = {}
    if angle is not None:
        for k in WAVES:
            waves["cos", k] = np.einsum("rmn,mn->rm", basis, np.cos(k * angle))
            waves["sin", k] = np.einsum("rmn,mn->rm", basis, np.sin(k * angle))
    coordinates = {axis: np.einsum("rmn,mn->rm", basis, outputs[axis]) for axis in axes}
    white = {axis: np.full(m, white_level_dps(outputs[axis], there) ** 2) / count for axis in axes}
    return ReducedRecording(
        recording.info, nodes, weights, waves, coordinates, present, white, dataset[begin],
        int(padded.there.sum() - there.sum()),
    )  # fmt: skip
