"""Nodes: a few places in each data set where slow regressors are evaluated."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.reduction.rectangular import Padded
from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.data.earth import up_rate_dps
from labctl.fitting.data.temperature.channel import with_stand_in
from labctl.fitting.data.temperature.history import history_of
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.columns import OWN_DATASET, RECORDING
from labctl.recording.decimation import FASTEST_HZ

#: Nodes per data set, at most.
NODES = 12


def nodes_of(
    recording: Recording, numbers: Mapping[str, Array], texts: Mapping[str, NDArray[np.generic]], padded: Padded,
    there: NDArray[np.float64], since: NDArray[np.float64], basis: NDArray[np.float64],
) -> tuple[Channels, NDArray[np.float64]]:  # fmt: skip
    """Return the channels at the nodes, (m * B,), and the weights (R, m, B) that bring them to coordinates."""
    m, n = there.shape
    edges = np.linspace(0, n, min(NODES, n) + 1).astype(np.int64)[:-1]
    inside = np.add.reduceat(there, edges, axis=1)

    def averaged(values: NDArray[np.float64]) -> NDArray[np.float64]:
        sums = np.add.reduceat(values * there, edges, axis=1)
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
    spacing = float(np.median(np.diff(since[0][: int(padded.there[0].sum())]))) if n > 1 else 1.0 / FASTEST_HZ
    middle = averaged(since)
    length = np.maximum(inside, 1.0) * spacing
    columns["since_begin_s"] = np.maximum(middle - length / 2, 0.0).ravel()
    columns["duration_s"] = length.ravel()
    position = texts["position"][begin] if "position" in texts else np.full(m, recording.info.axes[0])
    text: dict[str, NDArray[np.str_]] = {"position": np.repeat(np.asarray(position, dtype=np.str_), bins)}
    true = np.repeat(rate, bins) + up_rate_dps(recording.info)
    columns = with_stand_in(columns, m * bins)
    channels = Channels({**columns, **text}, body_rates(true, text["position"]), history_of(recording))
    return channels, weights
