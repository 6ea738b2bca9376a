"""Open-loop models: output = K(T) w + B(T) + sine error of each axis, solved for w by Newton's method.

Each axis has one constant k: its error is sin(k w) / k - w. Where the rest of the model is the identity the arcsine is
the inverse, and Newton's steps begin there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.models.fitted_model import FittedModel, without
from labctl.fitting.models.matrix_form import LINEAR, PIECE, Linear
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.open_loop_sine import cosine_of_root, sine_ratio

SINE = "sine_response"
#: Newton's steps, quadratic from the arcsine on; the C header takes as many.
STEPS = 12
#: The sine is taken as followed up to this share of its peak, where its slope is 0.
FOLLOWED = 0.9999


@dataclass(frozen=True)
class SineForm:
    """A linear model and a sine response."""

    fitted: FittedModel
    linear: Linear  #: the rest of the model

    def k_squared(self, temperature_c: Array) -> NDArray[np.float64]:
        """Return the squared constants, (n, axes) (rad/(rad/s))^2, at temperatures (n,) or (n, axes)."""
        columns = []
        for i, axis in enumerate(self.linear.axes):
            fit = self.fitted.axes[axis]
            axis_c = temperature_c if temperature_c.ndim == 1 else temperature_c[:, i]
            values = fit.values[fit.effects.index(SINE)] if SINE in fit.effects else np.zeros(fit.values.shape[1])
            columns.append(self.fitted.model.temperature.basis(axis_c) @ values)
        return np.column_stack(columns)

    def correct(self, raw: Array, temperature_c: Array) -> Array:
        """Return the true rates, (n, axes), of outputs (n, axes), deg/s."""
        row_c = np.broadcast_to(temperature_c, (len(raw),)) if temperature_c.ndim < 2 else temperature_c
        out = np.empty_like(raw)
        for start in range(0, len(raw), PIECE):
            piece = slice(start, start + PIECE)
            out[piece] = self._solved(raw[piece], row_c[piece])
        return out

    def _solved(self, raw: Array, temperature_c: Array) -> Array:
        gain, bias = self.linear.k_and_b(temperature_c)
        squares = self.k_squared(temperature_c)
        diagonal = np.arange(raw.shape[1])
        rate = arcsine_dps(raw - bias, squares)
        for _ in range(STEPS):
            x = squares * np.deg2rad(rate) ** 2
            residual = np.einsum("nij,nj->ni", gain, rate) + bias + rate * (sine_ratio(x) - 1.0) - raw
            slope = gain.copy()
            slope[:, diagonal, diagonal] += np.maximum(cosine_of_root(x), 1 - FOLLOWED) - 1.0
            step = np.linalg.solve(slope, residual[:, :, None])[:, :, 0]
            rate = rate - step
            if np.max(np.abs(step), initial=0.0) < 1e-12 * max(np.max(np.abs(rate), initial=0.0), 1.0):
                break
        return rate


def arcsine_dps(output_dps: Array, k_squared: Array) -> Array:
    """Return the rate w with output = sin(k w) / k, deg/s; with sinh where k^2 is negative. Both (n, axes)."""
    k = np.sqrt(np.maximum(np.abs(k_squared), 1e-12))
    phase = k * np.deg2rad(output_dps)
    followed = np.where(k_squared > 0, np.arcsin(np.clip(phase, -FOLLOWED, FOLLOWED)), np.arcsinh(phase))
    return np.asarray(np.rad2deg(followed / k))


def sine_form_of(fitted: FittedModel, axes: tuple[str, ...]) -> SineForm | None:
    """Return the form of a forward model of linear effects and a sine response; None for any other."""
    effects = set(fitted.model.effect_ids)
    if fitted.model.argument != "rate" or SINE not in effects or not effects <= LINEAR | {SINE}:
        return None
    if any("k_squared" not in fit.names for fit in fitted.axes.values() if SINE in fit.effects):
        return None  # of version 0.1, with a size of its own
    return SineForm(fitted, Linear(without(fitted, SINE), axes))
