"""Reduction of a recording of single readings."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.fitting.criticism.reduction.basis import WAVES, orthonormal_basis
from labctl.fitting.criticism.reduction.nodes import nodes_of
from labctl.fitting.criticism.reduction.outliers import inlier_mask, white_level_dps
from labctl.fitting.criticism.reduction.rectangular import pad, piece_labels
from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.decimation import FASTEST_HZ, decimated_columns
from labctl.recording.output_steps import output_steps, with_quantisation
from labctl.recording.quantisation import QUANTISATION


def reduce_samples(recording: Recording, *, outliers: bool) -> ReducedRecording:
    """Return the coordinates of every data set; without `outliers` every valid reading counts."""
    numbers, dataset, texts = decimated_columns(with_quantisation(recording))
    padded = pad(piece_labels({"dataset": dataset, **numbers}, recording.info.motion))
    m = len(padded.there)
    begin = padded.index[:, 0]
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64) / FASTEST_HZ)
    since = padded.of(t_s - t_s[begin].repeat(padded.there.sum(axis=1).astype(int)))
    angle = np.deg2rad(padded.of(numbers["table_angle_deg"])) if "table_angle_deg" in numbers else None
    axes: tuple[str, ...] = recording.info.axes
    outputs = {axis: padded.of(numbers[f"gyro_{axis}"]) for axis in axes}
    there, steps = padded.there, output_steps(recording)
    for axis in axes if outliers else ():
        there = there * inlier_mask(outputs[axis], padded.there, steps[axis].step_dps if axis in steps else 0.0)
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
    white = {}
    for axis in axes:
        noise = white_level_dps(outputs[axis], there) ** 2
        white[axis] = np.full(m, noise) / count + _steps_var(recording, numbers, axis)[begin]
    known = all(np.all(values > 0) for values in white.values())  # else no reading differs from the next
    return ReducedRecording(
        recording.info, nodes, weights, waves, coordinates, present, white if known else None, dataset[begin],
        int(padded.there.sum() - there.sum()),
    )  # fmt: skip


def _steps_var(recording: Recording, numbers: Mapping[str, Array], axis: str) -> Array:
    """Return what coarse steps of an output leave in a mean, at each reading (n,), (deg/s)^2."""
    left = numbers.get(f"gyro_{axis}{QUANTISATION}")
    if left is None:
        return np.zeros(len(numbers[f"gyro_{axis}"]))
    output = next((unit for name, unit in recording.info.output.items() if name == axis), None)
    return np.asarray((left / (output.scale if output else 1.0)) ** 2)
