"""What temperature does besides its value: how fast it changes, where it is felt, from which side it came."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from labctl.answers.fitted_model import Origin
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.thermal_lag import LAGS


class TemperatureRate(Effect):
    """Thermal transient of Shupe's kind."""

    id = "temperature_rate"
    in_use = False
    term = "Temperature rate sensitivity (Shupe effect)"
    sentence = "The bias shifts while the temperature changes, in proportion to the rate of change of the temperature."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("t_s",)
    parameters = (Parameter("of_gradient", "1", 0, 1), Parameter("over_s", "s", 40.0, 600.0, logarithmic=True))
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.05), "piezo": (0.0, 0.5)}
    experiment = "two ramp speeds at one constant rate; measure during and after the soak"
    draws = ("legs", "time")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the thermometer's rate of change or (`of_gradient`) the air temperature less the thermometer's."""
        if term.parameters.get("of_gradient", 0.0) and "chamber_c" in channels:
            lead = np.asarray(channels["chamber_c"], dtype=np.float64) - channels.temperature_c(axis)
            return [Column("chamber_lead", "deg/s/K", lead)]
        over_s = term.parameters.get("over_s", 300.0)
        return [Column("temperature_rate", "deg/s/(K/min)", channels.history.rate_k_min(channels.columns, over_s))]

    def options(self, span: Span) -> list[Term]:
        """Return a long slope, for a noisy thermometer, a short one, for a fast gyro, and the gradient if known."""
        slopes = by_parameter(self.id, of_gradient=np.array([0.0]), over_s=np.array([60.0, 300.0]))
        return slopes + ([Term(self.id, None, {"of_gradient": 1.0})] if span.has("chamber_c") else [])


class ThermalHysteresis(Effect):
    """Thermal hysteresis."""

    id = "thermal_hysteresis"
    remembers = True
    term = "Thermal hysteresis"
    sentence = "At the same temperature, the bias differs between heating and cooling."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("t_s",)
    parameters = (
        Parameter("width_k", "K", 1.0, 15.0, logarithmic=True),
        Parameter("bowed", "1", 0, 1),
        Parameter("rounded", "1", 0, 1),
    )
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.2), "piezo": (0.0, 0.2)}
    experiment = "temperatures on the way up and on the way down, then a smaller loop"
    draws = ("legs", "temperature_c")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return a play of the temperature; with `rounded` several, so that the new side is approached smoothly."""
        width_k = term.parameters.get("width_k", 3.0)
        state = channels.history.hysteresis_state(
            channels.columns, width_k, rounded=bool(term.parameters.get("rounded", 0.0))
        )
        if term.parameters.get("bowed", 0.0):
            temperature_c = channels.temperature_c(axis)
            low, high = channels.history.span_c
            low, high = term.parameters.get("low_c", low), term.parameters.get("high_c", high)
            share = np.clip((temperature_c - low) / max(high - low, 1e-9), 0.0, 1.0)
            state = state * 4 * share * (1 - share)
        return [Column("leg", "deg/s", state)]

    def kept(self, term: Term, history: TemperatureHistory) -> Term:
        """Return the term with the temperatures at which a bowed hysteresis vanishes: in use no recording has them."""
        if not term.parameters.get("bowed", 0.0):
            return term
        low, high = history.span_c
        return replace(term, parameters={"low_c": low, "high_c": high, **term.parameters})

    def options(self, span: Span) -> list[Term]:
        plain = by_parameter(self.id, width_k=np.array([1.5, 4.0, 8.0, 15.0]), bowed=np.array([0.0]))
        rounded = by_parameter(self.id, width_k=np.array([1.5, 4.0, 8.0, 15.0]), rounded=np.array([1.0]))
        return [*plain, *rounded, *by_parameter(self.id, width_k=np.array([1.5]), bowed=np.array([1.0]))]


class WarmUp(Effect):
    """Turn-on transient."""

    id = "warm_up"
    term = "Warm-up (turn-on transient)"
    sentence = "After power-on the bias settles over minutes to an hour."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("power_s",)
    parameters = (Parameter("tau_s", "s", 100.0, 7200.0, logarithmic=True),)
    ranges: ClassVar = {"fog": (0.0, 0.1), "mems": (0.0, 0.5), "piezo": (0.0, 2.0)}
    experiment = "a power cycle at constant temperature, and a wait of five time constants"
    draws = ("power_s", "time")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        on_s = np.asarray(channels["power_s"], dtype=np.float64)
        return [Column("warm_up", "deg/s", np.exp(-np.maximum(on_s, 0.0) / term.parameters.get("tau_s", 1800.0)))]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, tau_s=np.geomspace(300.0, 5400.0, 6))


class SelfHeating(Effect):
    """Self-heating."""

    id = "self_heating"
    term = "Self-heating"
    sentence = (
        "The unit's own power warms the sensing element above the temperature of the thermometer, increasingly after "
        "power-on."
    )
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("power_s",)
    parameters = (Parameter("tau_s", "s", 300.0, 3600.0, logarithmic=True),)
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.5), "piezo": (0.0, 5.0)}
    experiment = "compare the gyro's thermometer with the chamber's at rest, long after power-on"
    draws = ("power_s", "time")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """The share of the heating that is still to come: as bias, like a warm-up, and times the rate."""
        on_s = np.asarray(channels["power_s"], dtype=np.float64)
        missing = np.exp(-np.maximum(on_s, 0.0) / term.parameters.get("tau_s", 1200.0))
        return [
            Column("self_heating", "deg/s", missing),
            Column("self_heating_rate", "1", missing * channels.rate_dps(axis)),
        ]

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, tau_s=np.geomspace(300.0, 3600.0, 4))


class ThermometerError(Effect):
    """Thermometer error."""

    id = "thermometer_error"
    term = "Thermometer error"
    sentence = (
        "The thermometer reads wrong: the temperature terms of the calibration compensate for this, but with another "
        "thermometer the rate is wrong."
    )
    by_temperature = True
    origin: ClassVar[Origin] = "bench"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    ranges: ClassVar = {"fog": (-2.0, 2.0), "mems": (-2.0, 2.0), "piezo": (-2.0, 2.0)}
    experiment = "calibrate and use with the same thermometer; try a ramp that was not calibrated"
    draws = ("temperature_c", "map")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the temperature about its reference, as an error of the bias and of the scale factor."""
        centred = channels.temperature_c(axis) - reference.temperature_c
        return [
            Column("thermometer", "deg/s/K", centred),
            Column("thermometer_rate", "1/K", centred * channels.rate_dps(axis)),
        ]


EFFECTS: tuple[type[Effect], ...] = (
    TemperatureRate,
    *LAGS,
    ThermalHysteresis,
    WarmUp,
    SelfHeating,
    ThermometerError,
)
