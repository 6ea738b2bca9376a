"""Models that are linear in the rate: output = K(T) w + B(T), solved for w (Yang et al. 2018, eq. 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array

LINEAR = frozenset(
    {"bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment", "non_orthogonality"}
)
PIECE = 65_536


@dataclass(frozen=True)
class Linear:
    """K and B of a linear model at any temperature, for the axes that are recorded."""

    fitted: FittedModel
    axes: tuple[str, ...]

    def k_and_b(self, temperature_c: Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return K (n, axes, axes), K[output, input], and B (n, axes) in deg/s, at temperatures (n,) or (n, axes)."""
        n = len(temperature_c)
        channels = {"temperature_c": temperature_c if temperature_c.ndim == 1 else temperature_c.mean(axis=1)}
        if temperature_c.ndim == 2:
            channels |= {f"temperature_{axis}_c": temperature_c[:, i] for i, axis in enumerate(self.axes)}
        still = {axis: np.zeros(n) for axis in BODY_AXES}
        b = np.column_stack([self.fitted.error_dps(Channels(channels, still), axis) for axis in self.axes])
        k = np.zeros((n, len(self.axes), len(self.axes)))
        for column, turning in enumerate(self.axes):
            delayed = Channels(channels, still | {turning: np.ones(n)})
            for row, axis in enumerate(self.axes):
                k[:, row, column] = self.fitted.error_dps(delayed, axis) - b[:, row] + (row == column)
        return k, b

    def correct(self, raw: Array, temperature_c: Array) -> Array:
        """Return the true rates, (n, axes), of outputs (n, axes)."""
        row_c = np.broadcast_to(temperature_c, (len(raw),)) if temperature_c.ndim < 2 else temperature_c
        out = np.empty_like(raw)
        for start in range(0, len(raw), PIECE):
            piece = slice(start, start + PIECE)
            k, b = self.k_and_b(row_c[piece])
            out[piece] = np.linalg.solve(k, (raw[piece] - b)[:, :, None])[:, :, 0]
        return out


def linear_of(fitted: FittedModel, axes: tuple[str, ...]) -> Linear | None:
    """Return the linear form of a forward model that has one; None for any other."""
    if fitted.model.argument != "rate" or not LINEAR.issuperset(fitted.model.effect_ids):
        return None
    return Linear(fitted, axes)
