"""Result of a fit: the model with its coefficients, the error figures, and the noise that weighted the data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from labctl.fitting.effects.derived import with_derived
from labctl.fitting.estimation.error_metrics import ErrorFigures
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import none_for_nan


@dataclass(frozen=True)
class FitResult:
    """A fitted model with its errors, its noise by axis, and what is known of the Earth's rate on the bench."""

    fitted: FittedModel
    error: ErrorFigures
    temperature_c: tuple[float, float]  #: range of the readings, deg C
    rate_dps: tuple[float | None, float | None]  #: range of the true rates over all axes, deg/s; None: no limit
    noise: Mapping[str, Any] = field(default_factory=dict)  #: axis -> white noise and drift, as JSON
    environment: Mapping[str, Any] = field(default_factory=dict)
    residual_dps: Mapping[str, Array] = field(default_factory=dict)  #: axis -> (m,) corrected minus true rate, deg/s

    def to_json(self) -> dict[str, Any]:
        """Return what `labctl fit --json` gives of the model, besides serial and version."""
        model = self.fitted.model
        return {
            "model": {
                "name": model.name,
                "effects": model.effect_ids,
                "argument": model.argument,
                **{key: model.to_dict()[key] for key in ("terms", "temperature", "reference")},
            },
            "axes": {axis: {"coefficients": coefficients_json(model, fit)} for axis, fit in self.fitted.axes.items()},
            "error": self.error.to_dict(),
            "validity": {"temperature_c": list(self.temperature_c), "rate_dps": list(self.rate_dps)},
            "noise": dict(self.noise),
            "environment": dict(self.environment),
            "reference_temperature_c": model.reference.temperature_c,
        }


def coefficients_json(model: ErrorModel, fit: AxisFit) -> dict[str, Any]:
    """Return name -> value, standard uncertainty `u` and unit; lists over the nodes for a temperature table.

    `u` is None where there were no more data sets than coefficients.
    """
    u = none_for_nan(fit.u)
    if isinstance(model.temperature, LagrangeTable):
        table: dict[str, Any] = {"temperature_c": list(model.temperature.nodes_c)}
        for name, unit, values, us in zip(fit.names, fit.units, fit.values, u, strict=True):
            table[name] = {"value": values.tolist(), "u": us, "unit": unit}
        return with_derived(table)
    plain = {
        name: {"value": float(values[0]), "u": us[0], "unit": unit}
        for name, unit, values, us in zip(fit.names, fit.units, fit.values, u, strict=True)
    }
    return with_derived(plain)
