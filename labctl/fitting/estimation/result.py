"""Result of a fit: the model with its coefficients, the error figures, and the noise that weighted the data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from labctl.answers.fitted_model import (
    AxisNoiseJson,
    Coefficient,
    Coefficients,
    CoefficientTable,
    FitEnvironment,
    FitResultJson,
    LeftOutEffect,
)
from labctl.answers.joint import JointJson
from labctl.answers.poses import PosesJson
from labctl.fitting.effects.derived import with_derived, with_derived_tables
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
    temperature_c: tuple[float | None, float | None]  #: range of the readings, deg C; None: no thermometer
    rate_dps: tuple[float | None, float | None]  #: range of the true rates over all axes, deg/s; None: no limit
    noise: Mapping[str, AxisNoiseJson] = field(default_factory=dict)  #: axis -> white noise and drift, as JSON
    environment: FitEnvironment = field(default_factory=FitEnvironment)
    residual_dps: Mapping[str, Array] = field(default_factory=dict)  #: axis -> (m,) corrected minus true rate, deg/s
    poses: PosesJson | None = None  #: what a calibration by hand says beside its coefficients
    left_out_dps: Mapping[str, float] = field(default_factory=dict)  #: effect that is not exported -> its RMS, deg/s
    joint: JointJson | None = None  #: what several recordings say together; None for a single one
    mountings: Mapping[str, float] = field(default_factory=dict)  #: position -> its share in the slopes over the rate
    #: Effect -> name -> value, u and unit of the time constants and widths of what remembers.
    shapes: Mapping[str, dict[str, Coefficient]] = field(default_factory=dict)
    #: Output -> name -> angle of the mountings, rad, as far as they are separated from the misalignments.
    angles_rad: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def exported(self) -> tuple[FittedModel, list[LeftOutEffect]]:
        """Return the part of the model that belongs to the unit, and what was left out, with its size."""
        model, left_out = self.fitted.exported()
        return model, [{**one, "rms_dps": self.left_out_dps.get(one["effect"])} for one in left_out]

    def to_json(self) -> FitResultJson:
        """Return what `labctl fit --json` gives of the model, besides serial and version."""
        model = self.fitted.model
        whole = model.to_dict()
        result_json: FitResultJson = {
            "model": {
                "name": model.name,
                "effects": model.effect_ids,
                "argument": model.argument,
                "terms": whole["terms"],
                "temperature": whole["temperature"],
                "reference": whole["reference"],
            },
            "axes": {axis: {"coefficients": coefficients_json(model, fit)} for axis, fit in self.fitted.axes.items()},
            "error": self.error.to_dict(),
            "validity": {"temperature_c": list(self.temperature_c), "rate_dps": list(self.rate_dps)},
            "noise": dict(self.noise),
            "environment": self.environment,
            "reference_temperature_c": model.reference.temperature_c,
        }
        if "held" in whole:
            result_json["model"]["held"] = whole["held"]
        if self.shapes:
            result_json["shapes"] = dict(self.shapes)
        if self.poses is not None:
            result_json["poses"] = self.poses
        if self.joint is not None:
            result_json["joint"] = self.joint
        return result_json


def coefficients_json(model: ErrorModel, fit: AxisFit) -> Coefficients:
    """Return name -> value, standard uncertainty `u` and unit; lists over the nodes for a temperature table.

    `u` is None where there were no more data sets than coefficients.
    """
    u = none_for_nan(fit.u)
    if isinstance(model.temperature, LagrangeTable):
        tables: dict[str, CoefficientTable] = {
            name: {"value": values.tolist(), "u": us, "unit": unit_symbol}
            for name, unit_symbol, values, us in zip(fit.names, fit.units, fit.values, u, strict=True)
        }
        return {"temperature_c": list(model.temperature.nodes_c), **with_derived_tables(tables)}
    plain: dict[str, Coefficient] = {
        name: {"value": float(values[0]), "u": us[0], "unit": unit_symbol}
        for name, unit_symbol, values, us in zip(fit.names, fit.units, fit.values, u, strict=True)
    }
    return {**with_derived(plain)}
