"""What specific force adds to the output (IEEE Std 528, g-sensitivity): bias = G f + q f^2, f in g along the body axes.

The bias is the same at every rate and temperature, so that it is taken off before the rest of a model is solved.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import none_for_nan
from labctl.fitting.numeric.rounding import at_most

if TYPE_CHECKING:
    from labctl.answers.fitted_model import Coefficient, SpecificForceJson

#: What an accelerometer gives, and `Compensator` takes by this name.
INPUT = "specific_force_g"
EFFECTS = frozenset({"g_sensitivity", "cross_g_sensitivity", "g_squared_sensitivity"})
OWN, SQUARED = "g_own", "g_own_squared"


@dataclass(frozen=True)
class ForceSensitivity:
    """Coefficients of the gyro axes; NaN where the fit saw no force along a body axis."""

    axes: tuple[str, ...]
    per_g: NDArray[np.float64]  #: (axes, 3) deg/s/g, of the force along body axes x, y, z
    per_g2: Array  #: (axes,) deg/s/g^2, of the force along the gyro axis

    @cached_property
    def known_per_g(self) -> NDArray[np.float64]:
        """The coefficients with 0 for what was not measured, and so is not corrected; (axes, 3) deg/s/g."""
        return np.nan_to_num(self.per_g)

    @cached_property
    def known_per_g2(self) -> Array:
        """The same of the square, (axes,) deg/s/g^2."""
        return np.nan_to_num(self.per_g2)

    @property
    def at_1_g_dps(self) -> Array:
        """The largest error by 1 g in any direction, (axes,) deg/s; beside a square an upper bound of it."""
        return np.asarray(np.linalg.norm(self.known_per_g, axis=1) + np.abs(self.known_per_g2))

    @property
    def needs(self) -> list[str]:
        """The body axes whose force is needed."""
        needed = (self.known_per_g != 0).any(axis=0)
        for axis, square in zip(self.axes, self.known_per_g2, strict=True):
            needed[BODY_AXES.index(axis)] |= square != 0
        return [axis for axis, is_needed in zip(BODY_AXES, needed, strict=True) if is_needed]

    @property
    def not_measured(self) -> dict[str, list[str]]:
        """Gyro axis -> the body axes whose force its fit did not see."""
        unmeasured = {
            axis: [body for body, value in zip(BODY_AXES, row, strict=True) if np.isnan(value)]
            for axis, row in zip(self.axes, self.per_g, strict=True)
        }
        return {axis: bodies for axis, bodies in unmeasured.items() if bodies}

    def error_dps(self, specific_force_g: Array) -> Array:
        """Return the error, (n, axes) deg/s, of forces (n, 3) g; no number where a force is not finite."""
        is_known = np.isfinite(specific_force_g).all(axis=1, keepdims=True)
        force = np.where(is_known, specific_force_g, np.nan)
        along_axes_g = force[:, [BODY_AXES.index(axis) for axis in self.axes]]
        return np.asarray(force @ self.known_per_g.T + self.known_per_g2 * along_axes_g * along_axes_g)

    def forces(self, value: object, n: int) -> Array:
        """Return forces as (n, 3) g from (3,) or (n, 3); raises BadInput for another shape."""
        force_g = np.asarray(value, dtype=np.float64)
        if force_g.shape not in {(3,), (n, 3)}:
            raise BadInput(
                f"{INPUT} of shape {force_g.shape} given; give the specific force in g along body axes x, y and z: "
                "(3,), "
                f"or one row for each sample, ({n}, 3)"
            )
        return np.broadcast_to(force_g, (n, 3))

    def sentence(self) -> str:
        """Return what is not corrected without an accelerometer, with its size."""
        sizes = ", ".join(
            f"{axis} {at_most(size):.3g} deg/s" for axis, size in zip(self.axes, self.at_1_g_dps, strict=True)
        )
        return f"g-sensitivity is not corrected without {INPUT}; at 1 g at most: {sizes}"

    @staticmethod
    def from_json(document: SpecificForceJson, axes: tuple[str, ...]) -> ForceSensitivity:
        """Read the part of a calibration document; raises LookupError, TypeError or ValueError where it is not one."""
        if document["input"] != INPUT:
            raise ValueError(f"input {str(document['input'])[:80]!r} instead of {INPUT!r}")
        per_g, per_g2 = np.full((len(axes), 3), np.nan), np.full(len(axes), np.nan)
        for row, axis in enumerate(axes):
            for name, coefficients in document["coefficients"][axis].items():
                if name == SQUARED:
                    per_g2[row] = float(coefficients["value"])
                else:
                    body = axis if name == OWN else name.removeprefix("g_")
                    per_g[row, BODY_AXES.index(body)] = float(coefficients["value"])
        return ForceSensitivity(axes, per_g, per_g2)


def specific_force_json(fitted: FittedModel) -> SpecificForceJson | None:
    """Return a fitted model's sensitivity to specific force for its document; None for a model without one.

    One that changes with the temperature is none: a table of it cannot be distinguished from the bias on a bench.
    """
    terms = [term for term in fitted.model.terms if term.effect in EFFECTS]
    by_axis = {axis: _coefficients(fit) for axis, fit in fitted.axes.items()}
    changes = any(np.ptp(values) > 0 for fit in fitted.axes.values() for _, values in _rows(fit))
    if not terms or changes or not any(by_axis.values()):
        return None
    force_json: SpecificForceJson = {"input": INPUT, "coefficients": by_axis, "at_1_g_dps": {}, "not_measured": {}}
    whole = ForceSensitivity.from_json(force_json, tuple(by_axis))
    force_json["at_1_g_dps"] = dict(zip(whole.axes, whole.at_1_g_dps.tolist(), strict=True))
    force_json["not_measured"] = whole.not_measured
    return force_json


def _rows(fit: AxisFit) -> list[tuple[int, NDArray[np.float64]]]:
    return [(place, fit.values[place]) for place, owner in enumerate(fit.effects) if owner in EFFECTS]


def _coefficients(fit: AxisFit) -> dict[str, Coefficient]:
    u = none_for_nan(fit.u)
    return {
        fit.names[place]: {"value": float(values[0]), "u": u[place][0], "unit": fit.units[place]}
        for place, values in _rows(fit)
    }
