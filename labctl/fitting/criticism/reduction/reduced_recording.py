"""The reduced recording: m data sets in R coordinates each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.criticism import OutputStep
from labctl.fitting.data.channels import Carrier, Channels
from labctl.fitting.data.response import Response
from labctl.fitting.data.static_record import StaticRecord
from labctl.fitting.effects import Column
from labctl.fitting.numeric.arrays import Array
from labctl.recording import RecordingInfo


@dataclass(frozen=True)
class ReducedRecording:
    """m data sets in R coordinates each; coordinates are scaled so that the first is the mean, in deg/s."""

    info: RecordingInfo
    nodes: Channels  #: (m * B) rows, those of one data set together
    weights: NDArray[np.float64]  #: (R, m, B): coordinate k of a slow regressor is the sum of weights x nodes
    waves: Mapping[Carrier, NDArray[np.float64]]  #: (R, m) coordinates of a wave in the table angle
    output: Mapping[str, NDArray[np.float64]]  #: axis -> (R, m) coordinates of the output, deg/s
    present: NDArray[np.bool_]  #: (R, m): which coordinates exist in which data set
    white_var: Mapping[str, Array] | None  #: axis -> (m,) of the mean, white noise, (deg/s)^2
    dataset: NDArray[np.int64]  #: (m,) numbers
    left_out: int = 0  #: number of readings left out as outliers
    steps: Mapping[str, OutputStep] = field(default_factory=dict)  #: axis -> step, where steps matter in the means
    static: StaticRecord | None = None  #: the longest section at rest, where criticism uses one

    def __len__(self) -> int:
        return self.present.shape[1]

    def through(self, response: Response) -> ReducedRecording:
        """Return the same recording with the true rates as they come through a response."""
        nodes = self.nodes.through(response)
        return self if nodes is self.nodes else replace(self, nodes=nodes)

    def error_dps(self, axis: str) -> NDArray[np.float64]:
        """Return the coordinates of output minus true rate of an axis, (R, m) deg/s."""
        return self.output[axis] - self.rows_of(self.nodes.rate_dps(axis)[:, None])[:, :, 0]

    def instability_dps(self, axis: str) -> float | None:
        """Return the bias instability that a static record shows for an axis, deg/s; None without one."""
        return self.static.instability_dps(axis) if self.static is not None else None

    def at_sets(self, values: Array) -> Array:
        """Return node values (m * B,) averaged over each data set, (m,)."""
        return np.asarray(values.reshape(len(self), -1).mean(axis=1))

    def rows(self, column: Column) -> NDArray[np.float64]:
        """Return the coordinates of a regressor, (R, m)."""
        if column.carrier is not None and column.carrier in self.waves:
            return self.at_sets(column.values) * self.waves[column.carrier]
        values = column.mean(self.nodes)
        return np.einsum("rmb,mb->rm", self.weights, values.reshape(len(self), -1))

    def rows_of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the coordinates of slow regressors (m * B, k), as (R, m, k)."""
        k = values.shape[1]
        return np.einsum("rmb,mbk->rmk", self.weights, values.reshape(len(self), -1, k), optimize=True)
