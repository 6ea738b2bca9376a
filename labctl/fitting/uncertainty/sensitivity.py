"""Linear functions of a fitted error law at one temperature: its error at a rate, a bias, a scale factor, a tilt.

Each has a value, a gradient along the coefficients (for their covariance) and a slope over temperature.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array

#: Steps of numerical derivatives: along the rate for an inversion and for a coefficient, deg/s; over temperature, K.
STEP_DPS, COEFFICIENT_STEP_DPS, STEP_K = 0.01, 1.0, 0.05


class CoefficientFunction(Protocol):
    """What follows from the coefficients of one output axis."""

    @property
    def axis(self) -> str:
        """The output axis."""
        ...

    def gradient(self, fitted: FittedModel, temperature_c: float) -> Array:
        """Return its derivative along the coefficients of the axis, (k*m,), temperature functions running fastest."""
        ...


@dataclass(frozen=True)
class LawFunction:
    """A weighted sum of the modelled error of one output axis at rates about the body axes, divided by `divisor`."""

    axis: str  #: of the output
    rates: dict[str, Array]  #: body axis -> (n,) deg/s
    weights: Array  #: (n,)
    divisor: float = 1.0

    def value(self, fitted: FittedModel, temperature_c: float) -> float:
        """Return the sum at a temperature."""
        return float(self.weights @ fitted.error_dps(self._channels(temperature_c), self.axis)) / self.divisor

    def temperature_slope(self, fitted: FittedModel, temperature_c: float) -> float:
        """Return its derivative over temperature, per K."""
        both = {name: np.tile(rates, 2) for name, rates in self.rates.items()}
        temperatures_c = np.repeat([temperature_c + STEP_K, temperature_c - STEP_K], len(self.weights))
        above, below = fitted.error_dps(channels_at(self.axis, both, temperatures_c), self.axis).reshape(2, -1)
        return float(self.weights @ (above - below)) / self.divisor / (2 * STEP_K)

    def gradient(self, fitted: FittedModel, temperature_c: float) -> Array:
        """Return its derivative along the coefficients of the axis, (k*m,), temperature functions running fastest."""
        channels, fit = self._channels(temperature_c), fitted.axes[self.axis]
        n = len(self.weights)
        basis = fitted.model.temperature.basis(np.array([temperature_c]))[0]
        columns = {column.name: column for _, column in fitted.model.columns(channels, self.axis)}
        slopes = [
            float(self.weights @ columns[name].slope(np.full(n, at @ basis))) if name in columns else 0.0
            for name, at in zip(fit.names, fit.values, strict=True)
        ]
        return np.outer(slopes, basis).ravel() / self.divisor

    def _channels(self, temperature_c: float) -> Channels:
        return channels_at(self.axis, self.rates, np.full(len(self.weights), temperature_c))


@dataclass(frozen=True)
class OwnCoefficient:
    """A coefficient of one output axis itself, which is the same at all temperatures."""

    axis: str
    name: str

    def gradient(self, fitted: FittedModel, temperature_c: float) -> Array:  # noqa: ARG002  it is the same at each
        """Return its derivative along the coefficients of the axis, (k*m,)."""
        derivatives = np.zeros_like(fitted.axes[self.axis].values)
        derivatives[fitted.axes[self.axis].names.index(self.name), 0] = 1.0
        return derivatives.ravel()


def u_of_fit(law: CoefficientFunction, fitted: FittedModel, temperature_c: float) -> float | None:
    """Return the standard uncertainty of a function by the covariance of the coefficients (GUM eq. 13).

    Without the parts of the covariance that have lines of their own. None: not stated.
    """
    fit = fitted.axes[law.axis]
    if not np.any(fit.covariance) or fitted.model.held.without_u(law.axis):
        return None
    gradient = law.gradient(fitted, temperature_c)
    return math.sqrt(max(float(gradient @ fit.own_covariance @ gradient), 0.0))


def channels_at(axis: str, rates: dict[str, Array], temperatures_c: Array) -> Channels:
    """Return rows at rates about body axes, (n,) deg/s, and temperatures, (n,) deg C."""
    n = len(temperatures_c)
    columns = {
        "temperature_c": temperatures_c,
        "table_rate_dps": rates.get(axis, np.zeros(n)),
        "position": np.full(n, axis),
    }
    return Channels(columns, {name: rates.get(name, np.zeros(n)) for name in BODY_AXES})


def error_at(axis: str, rates_dps: Mapping[str, float]) -> LawFunction:
    """Return the modelled error of one output at one rate vector, body axis -> deg/s (0 about an axis not named)."""
    return LawFunction(axis, {name: np.array([rate]) for name, rate in rates_dps.items()}, np.ones(1))


def response(fitted: FittedModel, rates_dps: Mapping[str, float], temperature_c: float) -> Array:
    """Return the slopes of the n outputs along the rates about x, y and z at a rate vector, (n, 3)."""
    at = np.array([rates_dps.get(axis, 0.0) for axis in BODY_AXES])
    stepped = np.vstack([at, at + STEP_DPS * np.eye(len(BODY_AXES))])  # the place, then a step along each axis
    rates: dict[str, Array] = dict(zip(BODY_AXES, stepped.T, strict=True))
    temperatures_c = np.full(len(stepped), temperature_c)
    slopes = []
    for axis in fitted.axes:
        error = fitted.error_dps(channels_at(axis, rates, temperatures_c), axis)
        slopes.append((error[1:] - error[0]) / STEP_DPS + np.array([axis == body_axis for body_axis in BODY_AXES]))
    return np.array(slopes)


def correction_gain(fitted: FittedModel, response_of_outputs: Array) -> Array:
    """Return how errors of the outputs appear in the corrected rates, (n, n) over the outputs in order (GUM 5.1.3).

    The identity for a law of the output; a law of the true rate is inverted with the slopes of `response`, (n, 3).
    """
    axes = tuple(fitted.axes)
    if fitted.model.argument != "rate":
        return np.eye(len(axes))
    square = response_of_outputs[:, [BODY_AXES.index(axis) for axis in axes]]
    return np.asarray(np.linalg.inv(square), dtype=np.float64)


def coefficients_of(axis: str) -> dict[str, tuple[str, LawFunction]]:
    """Return name -> unit and function of what is a coefficient in every model: error at rest, and slopes about rest.

    The bias is in deg/s; `scale_factor` and `misalignment_<axis>` are errors as shares of the rate, so that they mean
    the same whatever terms a model is made of.
    """
    ends, weights = np.array([1.0, -1.0]) * COEFFICIENT_STEP_DPS, np.array([0.5, -0.5]) / COEFFICIENT_STEP_DPS
    others = {f"misalignment_{name}": name for name in BODY_AXES if name != axis}
    return {
        "bias": ("deg/s", LawFunction(axis, {}, np.ones(1))),
        "scale_factor": ("1", LawFunction(axis, {axis: ends}, weights)),
        **{name: ("1", LawFunction(axis, {other: ends}, weights)) for name, other in others.items()},
    }
