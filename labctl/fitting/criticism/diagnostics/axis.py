"""What the views of one axis are made of: its mean residuals and the noise that they have together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.noise_grid import correlation, factors, whiten
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.criticism.residuals import Residuals
from labctl.fitting.numeric.arrays import Array, over

#: Half width of a 95 % band, in standard deviations.
BAND = 1.96


@dataclass(frozen=True)
class AxisView:
    """One axis over m data sets, in the order in which they were measured."""

    axis: str
    data: ReducedRecording
    residual_dps: Array  #: (m,) of the means
    floor_dps: Array  #: (m,)
    covariance: NDArray[np.float64]  #: (m, m) of the means, (deg/s)^2
    whitened: Array  #: (m,) residuals with their correlation taken out, in noise units
    t_s: Array  #: (m,) from the recording's start; equal steps where no time is known
    run: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.residual_dps)

    @property
    def timed(self) -> bool:
        """Whether the recording says when each data set was measured."""
        return "t_s" in self.data.nodes

    @property
    def over_floor(self) -> Array:
        """Residuals in units of the noise floor, (m,)."""
        return over(self.residual_dps, self.floor_dps)

    def u_dps(self, weights: NDArray[np.float64]) -> Array:
        """Return the standard uncertainty of weighted sums of means, weights (k, m), as (k,)."""
        return np.sqrt(np.maximum(np.einsum("km,km->k", weights @ self.covariance, weights), 0.0))

    def channel(self, name: str) -> Array:
        """Return a logged number at each data set, (m,)."""
        return self.data.at_sets(np.asarray(self.data.nodes[name], dtype=np.float64))

    def temperature_c(self) -> Array:
        """Return the thermometer of this axis at each data set, (m,)."""
        return self.data.at_sets(self.data.nodes.temperature_c(self.axis))

    def position(self) -> NDArray[np.str_]:
        """Return how each data set was mounted, (m,)."""
        return np.asarray(self.data.nodes["position"]).reshape(len(self), -1)[:, 0].astype(np.str_)


def axis_view(comparison: Comparison, axis: str, residuals: Residuals) -> AxisView:
    """Return one axis at the noise that its base finds likeliest."""
    design, noise = comparison.designs[axis], comparison.axes[axis].best.noise
    white = comparison.white_var[axis]
    together = design.run[:, None] == design.run[None, :]
    covariance = noise.size_dps**2 * correlation(design.t_s, noise.tau_s) * together
    covariance[np.diag_indices(len(white))] += white
    blocks, _ = factors(noise, white, design.t_s, design.run)
    return AxisView(
        axis, comparison.data, residuals.means, residuals.floor_dps, covariance, whiten(blocks, residuals.means),
        design.t_s, design.run,
    )  # fmt: skip
