"""Reduction of a recording of single readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Motion
from labctl.fitting.criticism.reduction.basis import WAVES, orthonormal_basis
from labctl.fitting.criticism.reduction.outliers import inlier_mask, white_level_dps
from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.fitting.data.temperature.channel import with_stand_in
from labctl.fitting.data.temperature.history import history_of
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.columns import OWN_DATASET, RECORDING
from labctl.recording.decimation import FASTEST_HZ, decimated_columns
from labctl.recording.output_steps import output_steps, with_quantisation
from labctl.recording.points import dataset_starts, pieces
from labctl.recording.positions import comparable
from labctl.recording.quantisation import QUANTISATION

#: A data set longer than this many median ones is taken in pieces.
LONGEST = 4


@dataclass(frozen=True)
class Padded:
    """Readings as (m, n), n those of the longest data set, with zeros where there is none."""

    presence: NDArray[np.float64]  #: (m, n) 1 where there is a reading
    index: NDArray[np.int64]  #: (m, n) its row

    def of(self, values: Array) -> NDArray[np.float64]:
        """Return a column (rows,) as (m, n)."""
        return np.where(self.presence > 0, values[self.index], 0.0)


def pad(dataset: NDArray[np.int64]) -> Padded:
    """Return m data sets side by side, of labels (rows,) that change with the data set."""
    starts = dataset_starts(dataset)
    counts = np.diff(np.append(starts, len(dataset)))
    offset = np.arange(int(counts.max()))
    presence = offset[None, :] < counts[:, None]
    return Padded(presence.astype(np.float64), np.where(presence, starts[:, None] + offset, 0))


def piece_labels(columns: Mapping[str, NDArray[np.generic]], motion: Motion = "rates") -> NDArray[np.int64]:
    """Return labels (n,) that change with the row of the fit, and within one that is far longer than the median.

    A static record at one temperature is one row of the fit. In a rectangular array it would need memory, and its
    single mean would hide the drift within it.
    """
    rows = pieces(columns, motion)
    starts = dataset_starts(rows)
    counts = np.diff(np.append(starts, len(rows)))
    parts = -(-counts // max(int(LONGEST * np.median(counts)), 1))
    ordinal = np.arange(len(rows)) - np.repeat(starts, counts)
    first = np.concatenate([[0], np.cumsum(parts)[:-1]])
    return np.repeat(first, counts) + ordinal * np.repeat(parts, counts) // np.repeat(counts, counts)


#: Nodes per data set, at most.
NODES = 12


def nodes_of(
    recording: Recording, numbers: Mapping[str, Array], texts: Mapping[str, NDArray[np.generic]], padded: Padded,
    presence: NDArray[np.float64], since: NDArray[np.float64], basis: NDArray[np.float64],
) -> tuple[Channels, NDArray[np.float64]]:  # fmt: skip
    """Return the channels at the nodes, (m * B,), and the weights (R, m, B) that bring them to coordinates."""
    m, n = presence.shape
    edges = np.linspace(0, n, min(NODES, n) + 1).astype(np.int64)[:-1]
    inside = np.add.reduceat(presence, edges, axis=1)

    def averaged(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.add.reduceat(values * presence, edges, axis=1)
        whole = sums.sum(axis=1, keepdims=True) / np.maximum(inside.sum(axis=1, keepdims=True), 1.0)
        return np.where(inside > 0, sums / np.maximum(inside, 1.0), whole)

    weights = np.add.reduceat(basis, edges, axis=2)
    bins = len(edges)
    columns: dict[str, NDArray[np.generic]] = {}
    for name, values in numbers.items():
        if not name.startswith("gyro_"):
            columns[name] = averaged(padded.of(values)).ravel()
    begin = padded.index[:, 0]
    for name in ("run", "mounting", RECORDING, OWN_DATASET):
        if name in columns:
            columns[name] = np.repeat(numbers[name][begin], bins)
    rate = numbers["table_rate_dps"][begin]
    columns["table_rate_dps"] = np.repeat(rate, bins)
    previous = np.concatenate([[0.0], rate[:-1]])
    if RECORDING in numbers:  # nothing is remembered from one recording to the next
        previous[1:][np.diff(numbers[RECORDING][begin]) != 0] = 0.0
    columns["previous_rate_dps"] = np.repeat(previous, bins)
    spacing = float(np.median(np.diff(since[0][: int(padded.presence[0].sum())]))) if n > 1 else 1.0 / FASTEST_HZ
    middle = averaged(since)
    length = np.maximum(inside, 1.0) * spacing
    columns["since_begin_s"] = np.maximum(middle - length / 2, 0.0).ravel()
    columns["duration_s"] = length.ravel()
    position = texts["position"][begin] if "position" in texts else np.full(m, recording.info.axes[0])
    position = comparable(np.asarray(position), rate != 0)
    text: dict[str, NDArray[np.str_]] = {"position": np.repeat(position, bins)}
    true = np.repeat(rate, bins) + up_rate_dps(recording.info)
    columns = with_stand_in(columns, m * bins)
    channels = Channels({**columns, **text}, body_rates(true, text["position"]), history_of(recording))
    return channels, weights


def reduce_samples(recording: Recording, *, outliers: bool) -> ReducedRecording:
    """Return the coordinates of every data set; without `outliers` every valid reading counts."""
    numbers, dataset, texts = decimated_columns(with_quantisation(recording))
    padded = pad(piece_labels({"dataset": dataset, **numbers}, recording.info.motion))
    m = len(padded.presence)
    begin = padded.index[:, 0]
    t_s = numbers.get("t_s", np.arange(len(dataset), dtype=np.float64) / FASTEST_HZ)
    since = padded.of(t_s - t_s[begin].repeat(padded.presence.sum(axis=1).astype(int)))
    angle = np.deg2rad(padded.of(numbers["table_angle_deg"])) if "table_angle_deg" in numbers else None
    axes: tuple[str, ...] = recording.info.axes
    outputs = {axis: padded.of(numbers[f"gyro_{axis}"]) for axis in axes}
    presence, steps = padded.presence, output_steps(recording)
    for axis in axes if outliers else ():
        presence = presence * inlier_mask(
            outputs[axis], padded.presence, steps[axis].step_dps if axis in steps else 0.0
        )
    # the lines of the steps need the angle turned, from any origin: both of their waves are removed
    turn_rad = angle if angle is not None else np.deg2rad(padded.of(numbers["table_rate_dps"])) * since
    basis, present = orthonormal_basis(presence, since, turn_rad, angle)
    count = np.maximum(presence.sum(axis=1), 1.0)
    basis /= np.sqrt(count)[None, :, None]
    nodes, weights = nodes_of(recording, numbers, texts, padded, presence, since, basis)
    waves = {}
    if angle is not None:
        for k in WAVES:
            waves["cos", k] = np.einsum("rmn,mn->rm", basis, np.cos(k * angle))
            waves["sin", k] = np.einsum("rmn,mn->rm", basis, np.sin(k * angle))
    coordinates = {axis: np.einsum("rmn,mn->rm", basis, outputs[axis]) for axis in axes}
    white = {}
    for axis in axes:
        noise = white_level_dps(outputs[axis], presence) ** 2
        white[axis] = np.full(m, noise) / count + _steps_var(recording, numbers, axis)[begin]
    has_white = all(np.all(values > 0) for values in white.values())  # else no reading differs from the next
    return ReducedRecording(
        recording.info, nodes, weights, waves, coordinates, present, white if has_white else None, dataset[begin],
        int(padded.presence.sum() - presence.sum()),
    )  # fmt: skip


def _steps_var(recording: Recording, numbers: Mapping[str, Array], axis: str) -> Array:
    """Return what coarse steps of an output leave in a mean, at each reading (n,), (deg/s)^2."""
    step_columns = numbers.get(f"gyro_{axis}{QUANTISATION}")
    if step_columns is None:
        return np.zeros(len(numbers[f"gyro_{axis}"]))
    output = next((output_unit for name, output_unit in recording.info.output.items() if name == axis), None)
    return np.asarray((step_columns / (output.scale if output else 1.0)) ** 2)
