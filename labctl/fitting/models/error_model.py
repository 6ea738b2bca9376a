"""An error model: an ordered set of effects, and how temperature enters. Fitted, it predicts and compensates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from labctl.errors import LabctlError
from labctl.fitting.data.channels import Channels
from labctl.fitting.effects import Column, Reference, Term, kind_of
from labctl.fitting.models.temperature import Constant, TemperatureBasis, basis_from_dict
from labctl.fitting.numeric.arrays import Array

Argument = Literal["rate", "output"]
#: Effects of these origins belong to the unit and leave the house with its calibration.
#: Rounds over the axes, and halvings of an interval, where the quick way to invert a model does not converge.
ROUNDS, HALVINGS = 8, 50
EXPORTED_ORIGINS = frozenset({"sensor", "package"})


def is_exported(term: Term) -> bool:
    """Return whether an effect is the unit's own and can be corrected where the unit is used."""
    found = kind_of(term)
    return found.origin in EXPORTED_ORIGINS and found.in_use


@dataclass(frozen=True)
class ErrorModel:
    """A set of effects. `argument` says whether rate regressors see the true rate or the gyro's output."""

    name: str
    terms: tuple[Term, ...]
    argument: Argument = "rate"
    temperature: TemperatureBasis = field(default_factory=Constant)
    reference: Reference = field(default_factory=Reference)

    @property
    def effect_ids(self) -> list[str]:
        """The ids of the effects, in order."""
        return [term.effect for term in self.terms]

    @property
    def needs(self) -> tuple[str, ...]:
        """The channels that its effects need beside rate and temperature."""
        return tuple(sorted({name for term in self.terms for name in kind_of(term).needs}))

    @property
    def steady(self) -> frozenset[str]:
        """The ids of the effects that have one coefficient for all temperatures."""
        return frozenset(term.effect for term in self.terms if term.steady)

    def columns(self, channels: Channels, axis: str) -> list[tuple[str, Column]]:
        """Return (effect id, regressor) of one output axis, before temperature multiplies the regressors."""
        return [
            (effect_id, replace(column, values=column.mean(channels), carrier=None))
            for effect_id, column in self.carried(channels, axis)
        ]

    def carried(self, channels: Channels, axis: str) -> list[tuple[str, Column]]:
        """Return the same with the waves in the table angle that some of them are the size of."""
        return [
            (term.effect, column)
            for term in self.terms
            for column in kind_of(term).columns(channels, axis, term, self.reference)
        ]

    def with_terms(self, terms: tuple[Term, ...], name: str | None = None) -> ErrorModel:
        """Return the same model with other effects."""
        return replace(self, terms=terms, name=name or self.name)

    def to_dict(self) -> dict[str, Any]:
        """Return the model without coefficients, as JSON."""
        return {
            "name": self.name,
            "argument": self.argument,
            "terms": [{**asdict(t), "parameters": dict(t.parameters)} for t in self.terms],
            "temperature": self.temperature.to_dict(),
            "reference": {"temperature_c": self.reference.temperature_c},
        }

    @staticmethod
    def from_dict(record: Mapping[str, Any]) -> ErrorModel:
        """Return the model that `to_dict` described."""
        return ErrorModel(
            record["name"],
            tuple(
                Term(t["effect"], t["order"], dict(t["parameters"]), t.get("formula", ""), t.get("steady", False))
                for t in record["terms"]
            ),
            record["argument"],
            basis_from_dict(record["temperature"]),
            Reference(record["reference"]["temperature_c"]),
        )

    def forward(self) -> ErrorModel:
        """Return the same effects as a law of the true rate: the form that is physics, and that criticism judges."""
        return replace(self, argument="rate")


def expand(columns: Array, basis: Array) -> Array:
    """Return each column (n, k) times each temperature function (n, m), (n, k*m), the functions running fastest."""
    return (columns[:, :, None] * basis[:, None, :]).reshape(len(columns), -1)


@dataclass(frozen=True)
class AxisFit:
    """The coefficients of one output axis: k names by m temperature functions."""

    effects: tuple[str, ...]  #: the effect that each name belongs to
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]  #: (k, m)
    covariance: NDArray[np.float64]  #: (k*m, k*m), the temperature functions running fastest

    @property
    def u(self) -> NDArray[np.float64]:
        """Standard uncertainties, (k, m); NaN where there were no more data than coefficients."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(self.values.shape)


#: A step this many times the one before does not lead to a rate.
DIVERGING = 3.0


class NotConverged(LabctlError):
    """The model's error changes faster than the rate itself; it cannot be inverted."""

    slug = "not-converged"


@dataclass(frozen=True)
class FittedModel:
    """An error model with its coefficients."""

    model: ErrorModel
    axes: Mapping[str, AxisFit]

    def error_dps(self, channels: Channels, axis: str) -> Array:
        """Return the modelled error of an output axis, (n,) deg/s: gyro minus true rate."""
        fit = self.axes[axis]
        basis = self.model.temperature.basis(channels.temperature_c(axis))
        at_temperature = fit.values @ basis.T  # (k, n)
        error = np.zeros(len(channels))
        by_name = dict(zip(fit.names, at_temperature, strict=True))
        for _, column in self.model.columns(channels, axis):
            if column.name in by_name:
                error += column.values * by_name[column.name]
        return error

    def compensate(self, outputs: Mapping[str, Array], channels: Channels) -> dict[str, Array]:
        """Return the true rate along each recorded axis, axis -> (n,) deg/s, from outputs axis -> (n,) deg/s.

        A direct law is subtracted (Ojeda eq. 13). A forward law is solved for the rate by fixed-point iteration, which
        converges because a gyro's error changes far less than its rate. Raises NotConverged where it does not.
        """
        if self.model.argument == "output":
            seen = channels.with_rates(outputs)
            return {axis: outputs[axis] - self.error_dps(seen, axis) for axis in outputs}
        rates, change = dict(outputs), 0.0
        for _ in range(60):
            seen = channels.with_rates(rates)
            nearer = {axis: outputs[axis] - self.error_dps(seen, axis) for axis in outputs}
            before, change = (
                change,
                max(float(np.max(np.abs(nearer[axis] - rates[axis]), initial=0.0)) for axis in outputs),
            )
            rates = nearer
            if change < 1e-12:
                return rates
            if before and change > DIVERGING * before:
                break
        return self._enclosed(outputs, channels, dict(outputs))

    def _enclosed(self, outputs: Mapping[str, Array], channels: Channels, rates: dict[str, Array]) -> dict[str, Array]:
        """Solve by halving intervals, axis by axis: slower, and right where an error has a steep flank."""
        for _ in range(ROUNDS):
            before = dict(rates)
            for axis, output in outputs.items():
                rates = {**rates, axis: self._halved(output, channels, rates, axis)}
            change = max(float(np.max(np.abs(rates[axis] - before[axis]), initial=0.0)) for axis in outputs)
            if change < 1e-9:
                return rates
        raise NotConverged(
            f"model {self.model.name!r} could not be inverted: the last step still changed the rate by {change:.3g} "
            "deg/s; its coefficients are not those of a gyro (check the fit's validity range and the output's scale)"
        )

    def _halved(self, output: Array, channels: Channels, rates: Mapping[str, Array], axis: str) -> Array:
        reach = 0.02 * np.max(np.abs(output), initial=0.0) + 10.0
        low, high = output - reach, output + reach
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            seen = channels.with_rates({**rates, axis: middle})
            above = middle + self.error_dps(seen, axis) > output
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return np.asarray(0.5 * (low + high))

    def exported(self) -> tuple[FittedModel, list[dict[str, str]]]:
        """Return the part that belongs to the unit, and what was left out with its origin."""
        kept = tuple(t for t in self.model.terms if is_exported(t))
        left_out = [
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

    def to_dict(self) -> dict[str, Any]:
        """Return everything needed to rebuild this model, as JSON."""
        return {
            **self.model.to_dict(),
            "axes": {
                axis: {
                    "effects": list(fit.effects),
                    "names": list(fit.names),
                    "units": list(fit.units),
                    "values": fit.values.tolist(),
                    # NaN, which JSON has not, becomes null, and NaN again when it is read
                    "covariance": np.where(np.isnan(fit.covariance), None, fit.covariance).tolist(),  # type: ignore[call-overload]
                }
                for axis, fit in self.axes.items()
            },
        }

    @staticmethod
    def from_dict(record: Mapping[str, Any]) -> FittedModel:
        """Return the model that `to_dict` described."""
        model = ErrorModel.from_dict(record)
        axes = {
            axis: AxisFit(
                tuple(fit["effects"]),
                tuple(fit["names"]),
                tuple(fit["units"]),
                np.asarray(fit["values"], dtype=np.float64),
                np.asarray(fit["covariance"], dtype=np.float64),
            )
            for axis, fit in record["axes"].items()
        }
        return FittedModel(model, axes)


def _only(fit: AxisFit, effects: set[str]) -> AxisFit:
    kept = [index for index, owner in enumerate(fit.effects) if owner in effects]
    m = fit.values.shape[1]
    flat = np.concatenate([np.arange(index * m, (index + 1) * m) for index in kept]) if kept else np.zeros(0, dtype=int)
    return AxisFit(
        tuple(fit.effects[i] for i in kept),
        tuple(fit.names[i] for i in kept),
        tuple(fit.units[i] for i in kept),
        fit.values[kept],
        fit.covariance[np.ix_(flat, flat)],
    )
