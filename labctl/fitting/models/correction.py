"""A fitted model as a function of outputs and temperatures, in its fastest exact form."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.matrix_form import Linear, linear_of
from labctl.fitting.models.polynomial_surface import Surface, bias_surface_of, surface_of
from labctl.fitting.models.sine_form import sine_form_of
from labctl.fitting.numeric.arrays import Array

Correct = Callable[[Array, Array, Mapping[str, Array]], Array]
#: Steps in which a scale factor that lags is solved with the rest of a law, and the change of the rate, as a share of
#: the largest, at which they end. Each shrinks the error by the scale errors of both, a few thousand times.
SCALE_STEPS, SCALE_CLOSE = 12, 1e-15


def correct_across(
    fitted: FittedModel, axes: tuple[str, ...], across_dps: Mapping[str, Array],
    raw: Array, temperature_c: Array, channels: Mapping[str, Array],
) -> Array:  # fmt: skip
    """Apply any model to rates (n, axes) at temperatures (n,) or (n, axes), deg/s, in its general form.

    `across_dps` are true rates about axes without an output, axis -> (n,) deg/s; one that is absent is at rest.
    """
    n = len(raw)
    row_c = np.broadcast_to(temperature_c, (n,)) if temperature_c.ndim < 2 else temperature_c.mean(axis=1)
    columns: dict[str, Array] = {"temperature_c": row_c, **channels}
    if temperature_c.ndim == 2:
        columns |= {f"temperature_{axis}_c": temperature_c[:, i] for i, axis in enumerate(axes)}
    outputs = {axis: raw[:, i] for i, axis in enumerate(axes)}
    corrected = fitted.compensate(outputs, Channels(columns, outputs), across_dps)
    return np.column_stack([corrected[axis] for axis in axes])


def with_scale(correct: Callable[[Array], Array], output: Array, scale: Array, low: float, high: float) -> Array:
    """Return rates w, (n, axes) deg/s, with w = correct(output - scale * w), for scale errors (n, axes) of a lag.

    `correct` is the correction by the rest of a law of the rate. Outside `low` to `high`, deg/s, the error at the edge
    is taken. What is no number stays so. Where the steps end they change the rate by rounding alone.
    """
    gain = 1.0 + scale
    rate = correct(output) / gain
    before = np.inf
    for _ in range(SCALE_STEPS):
        step = (correct(output - scale * np.clip(rate, low, high)) - rate) / gain
        rate = rate + step
        change = float(np.max(np.abs(step[~np.isnan(step)]), initial=0.0))
        size = float(np.max(np.abs(rate[~np.isnan(rate)]), initial=1.0))
        if change <= SCALE_CLOSE * size or not change < before:
            break
        before = change
    return rate


def correction(fitted: FittedModel, axes: tuple[str, ...]) -> Correct:
    """Return the fastest exact way to apply a model: (rates (n, axes), temperatures) -> rates (n, axes)."""
    surface: Surface | None = surface_of(fitted, axes) or bias_surface_of(fitted, axes)
    if surface is not None:
        return lambda raw, temperature_c, _: surface.correct(raw, temperature_c)
    linear: Linear | None = linear_of(fitted, axes)
    if linear is not None:
        return lambda raw, temperature_c, _: linear.correct(raw, temperature_c)

    sine = sine_form_of(fitted, axes)
    if sine is not None:
        return lambda raw, temperature_c, _: sine.correct(raw, temperature_c)

    return partial(correct_across, fitted, axes, {})
