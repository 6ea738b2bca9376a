"""The direct polynomial in rate and temperature on long arrays: Horner's scheme in pieces that fit the cache."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.temperature import Constant
from labctl.fitting.numeric.arrays import Array

#: Samples that are worked on together: every array of the scheme stays in the first- and second-level cache.
PIECE = 16_384


@dataclass(frozen=True)
class Surface:
    """w - sum c[i, j] w^i (T - T0)^j for each axis."""

    coefficients: NDArray[np.float64]  #: (axes, rate powers, temperature powers)
    reference_c: float

    def correct(self, raw: Array, temperature_c: Array) -> Array:
        """Return corrected rates, (n, axes), from outputs (n, axes) and temperatures (n,), (n, axes) or one for all."""
        out = np.empty_like(raw)
        row_c = np.asarray(temperature_c, dtype=np.float64)
        buffers = np.empty(PIECE), np.empty(PIECE), np.empty(PIECE)
        for start in range(0, len(raw), PIECE):  # all axes of a piece, as they lie between each other in memory
            piece = slice(start, start + PIECE)
            u, row, total = (buffer[: len(raw[piece])] for buffer in buffers)
            for axis, c in enumerate(self.coefficients):
                if axis == 0 or row_c.ndim == 2:
                    of_axis = row_c[piece, axis] if row_c.ndim == 2 else row_c[piece] if row_c.ndim else row_c
                    np.subtract(of_axis, self.reference_c, out=u)
                _sum(c, raw[piece, axis], u, row, total)
                np.subtract(raw[piece, axis], total, out=out[piece, axis])
        return out


def _sum(c: NDArray[np.float64], w: Array, u: Array, row: Array, total: Array) -> None:
    """Write sum c[i, j] w^i u^j of rates and centred temperatures, (n,), into `total`; `row` is overwritten."""
    rate_powers, temperature_powers = c.shape
    for i in range(rate_powers - 1, -1, -1):
        target = total if i == rate_powers - 1 else row
        np.multiply(u, c[i, -1], out=target)
        for j in range(temperature_powers - 2, 0, -1):
            target += c[i, j]
            target *= u
        target += c[i, 0]
        if i < rate_powers - 1:
            total *= w
            total += row


def surface_of(fitted: FittedModel, axes: tuple[str, ...]) -> Surface | None:
    """Return the polynomial of a direct model that is nothing but one; None for any other."""
    if fitted.model.argument != "output" or fitted.model.effect_ids != ["rate_temperature_surface"]:
        return None
    surface_terms = []
    for axis in axes:
        powers = {
            tuple(int(part) for part in name.removeprefix("c_r").split("_t")): float(values[0])
            for name, values in zip(fitted.axes[axis].names, fitted.axes[axis].values, strict=True)
        }
        c = np.zeros((1 + max(i for i, _ in powers), 1 + max(j for _, j in powers)))
        for (i, j), value in powers.items():
            c[i, j] = value
        surface_terms.append(c)
    return Surface(np.stack(surface_terms), fitted.model.reference.temperature_c)


#: Effects that no rate changes: a polynomial of temperature, right for an argument of either kind.
OF_TEMPERATURE = {"bias", "bias_temperature"}


def bias_surface_of(fitted: FittedModel, axes: tuple[str, ...]) -> Surface | None:
    """Return the polynomial of temperature of a model that is a bias and nothing else; None for any other."""
    model = fitted.model
    if not isinstance(model.temperature, Constant) or not set(model.effect_ids) <= OF_TEMPERATURE or model.held.axes:
        return None
    powers = [
        {int(name.removeprefix("bias_t")) if name != "bias" else 0: float(values[0]) for name, values in coefficients}
        for coefficients in (zip(fitted.axes[axis].names, fitted.axes[axis].values, strict=True) for axis in axes)
    ]
    c = np.zeros((len(axes), 1, 1 + max(1, *(max(each, default=0) for each in powers))))
    for axis, each in enumerate(powers):
        for power, value in each.items():
            c[axis, 0, power] = value
    return Surface(c, model.reference.temperature_c)
