"""An error model with its coefficients: predicts the error of a gyro and compensates its output."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.effects.scale_factor import FREE_AMPLITUDE
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.error_part import ErrorPart
from labctl.fitting.models.inversion import invert
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import none_for_nan

if TYPE_CHECKING:
    from labctl.answers.fitted_model import AxisFitJson, FittedModelJson, LeftOutEffect


@dataclass(frozen=True)
class AxisFit:
    """The coefficients of one output axis: k names by m temperature functions."""

    effects: tuple[str, ...]  #: the effect that each name belongs to
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]  #: (k, m)
    covariance: NDArray[np.float64]  #: (k*m, k*m), the temperature functions running fastest
    parts: tuple[ErrorPart, ...] = ()  #: of the covariance, by errors of the reference; they are in it

    @property
    def u(self) -> NDArray[np.float64]:
        """Standard uncertainties, (k, m); NaN without more data than coefficients, or where a table states none."""
        if not np.any(self.covariance):
            return np.full(self.values.shape, np.nan)
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.values.shape)

    @property
    def own_covariance(self) -> NDArray[np.float64]:
        """The covariance without its parts: by the scatter of the data, and by coefficients that were held."""
        return np.asarray(self.covariance - sum(part.covariance for part in self.parts))

    def u_of(self, name: str) -> float:
        """Return the standard uncertainty of a coefficient, the first of a table; NaN where there is none."""
        return float(self.u[self.names.index(name), 0]) if name in self.names else float("nan")

    def value_of(self, name: str) -> float:
        """Return a coefficient, the first of a table."""
        return float(self.values[self.names.index(name), 0])


@dataclass(frozen=True)
class FittedModel:
    """An error model with its coefficients."""

    model: ErrorModel
    axes: Mapping[str, AxisFit]

    def error_dps(self, channels: Channels, axis: str) -> Array:
        """Return the modelled error of an output axis, (n,) deg/s: gyro minus true rate."""
        return self._error_with(self._coefficients(channels, axis), channels, axis)

    def _coefficients(self, channels: Channels, axis: str) -> dict[str, Array]:
        """Return name -> (n,), the coefficients of an axis at the temperatures of the rows."""
        fit = self.axes[axis]
        basis = self.model.temperature.basis(channels.temperature_c(axis))
        return dict(zip(fit.names, fit.values @ basis.T, strict=True))

    def _error_with(self, coefficients: Mapping[str, Array], channels: Channels, axis: str) -> Array:
        error = np.zeros(len(channels))
        for _, column in self.model.columns(channels, axis):
            if column.name in coefficients:
                error += column.error_dps(coefficients[column.name])
        return error

    def compensate(
        self, outputs: Mapping[str, Array], channels: Channels, across_dps: Mapping[str, Array] | None = None
    ) -> dict[str, Array]:
        """Return the true rate along each recorded axis, axis -> (n,) deg/s, from outputs axis -> (n,) deg/s.

        A direct law is subtracted (Ojeda et al. 2000, eq. 13); a forward law is solved for the rate (`invert`).
        `across_dps` are true rates about axes without an output, axis -> (n,) deg/s, where they are known; an axis that
        is neither counts as at rest. Raises NotConverged where there is no solution.
        """
        across = across_dps or {}
        if self.model.argument == "output":
            seen = channels.with_rates({**across, **outputs})
            return {axis: outputs[axis] - self.error_dps(seen, axis) for axis in outputs}
        known = {axis: self._coefficients(channels, axis) for axis in outputs}
        return invert(
            outputs,
            lambda rates, axis: self._error_with(known[axis], channels.with_rates({**across, **rates}), axis),
            self.model.name,
        )

    def exported(self) -> tuple[FittedModel, list[LeftOutEffect]]:
        """Return the part that belongs to the unit, and what was left out with its origin."""
        kept = tuple(t for t in self.model.terms if is_exported(t))
        left_out: list[LeftOutEffect] = [
            {"effect": t.effect, "origin": kind_of(t).origin, "term": kind_of(t).term}
            for t in self.model.terms
            if not is_exported(t)
        ]
        if not left_out:
            return self, []
        model = self.model.with_terms(kept)
        return FittedModel(
            model, {axis: _only(fit, set(model.effect_ids)) for axis, fit in self.axes.items()}
        ), left_out

    def to_dict(self) -> FittedModelJson:
        """Return everything needed to rebuild this model, as JSON."""
        return {
            **self.model.to_dict(),
            "axes": {axis: _axis_json(fit) for axis, fit in self.axes.items()},
        }

    @staticmethod
    def from_dict(record: FittedModelJson) -> FittedModel:
        """Return the model that `to_dict` described."""
        model = ErrorModel.from_dict(record)
        if any("sine_response" in fit["names"] for fit in record["axes"].values()):
            model = model.with_terms(tuple(map(_with_free_amplitude, model.terms)))
        axes = {
            axis: AxisFit(
                tuple(fit["effects"]),
                tuple(fit["names"]),
                tuple(fit["units"]),
                np.asarray(fit["values"], dtype=np.float64),
                np.asarray(fit["covariance"], dtype=np.float64),
                tuple(map(ErrorPart.from_json, fit.get("parts", []))),
            )
            for axis, fit in record["axes"].items()
        }
        return FittedModel(model, axes)


def _axis_json(fit: AxisFit) -> AxisFitJson:
    document: AxisFitJson = {
        "effects": list(fit.effects),
        "names": list(fit.names),
        "units": list(fit.units),
        "values": fit.values.tolist(),
        "covariance": none_for_nan(fit.covariance),
    }
    if fit.parts:
        document["parts"] = [part.to_json() for part in fit.parts]
    return document


def _with_free_amplitude(term: Term) -> Term:
    """Return the term of a calibration of version 0.1, whose sine response has a size beside its K."""
    if term.effect != "sine_response":
        return term
    return replace(term, parameters={"k": term.parameters.get("k", 0.3), FREE_AMPLITUDE: 1.0})


def without(fitted: FittedModel, effect_id: str) -> FittedModel:
    """Return a fitted model without one of its effects, the others as they were fitted beside it."""
    model = fitted.model.with_terms(tuple(t for t in fitted.model.terms if t.effect != effect_id))
    return FittedModel(model, {axis: _only(fit, set(model.effect_ids)) for axis, fit in fitted.axes.items()})


def _only(fit: AxisFit, effects: set[str]) -> AxisFit:
    """Return the coefficients of some effects, with their part of the covariance."""
    kept = [index for index, owner in enumerate(fit.effects) if owner in effects]
    m = fit.values.shape[1]
    flat = np.concatenate([np.arange(index * m, (index + 1) * m) for index in kept]) if kept else np.zeros(0, dtype=int)
    return AxisFit(
        tuple(fit.effects[i] for i in kept),
        tuple(fit.names[i] for i in kept),
        tuple(fit.units[i] for i in kept),
        fit.values[kept],
        fit.covariance[np.ix_(flat, flat)],
        tuple(part.take(flat) for part in fit.parts),
    )
