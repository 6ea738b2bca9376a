"""What temperature does besides its value: how fast it changes, where it is felt, from which side it came."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.temperature.history import TemperatureHistory
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import IEEE_952, WEISS, Equation, Source, Symbol, term_528
from labctl.fitting.effects.thermal_lag import LAGS

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


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
    parameters = (
        Parameter(
            "of_gradient",
            "1",
            0,
            1,
            meaning="1: the air temperature less the thermometer's is used; 0: the rate of change of the thermometer",
        ),
        Parameter(
            "over_s",
            "s",
            40.0,
            600.0,
            logarithmic=True,
            symbol="tau_s",
            meaning="duration over which the slope of the temperature is taken",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.05), "piezo": (0.0, 0.5)}
    experiment = "two ramp speeds at one constant rate; measure during and after the soak"
    draws = ("legs", "time")
    equation: ClassVar = Equation(
        "D_c * (T_c - T) if of_gradient else D * Tdot",
        (
            Symbol("D", "error per rate of change of the temperature", "deg/s/(K/min)", "temperature_rate"),
            Symbol("D_c", "error per difference between air and thermometer", "deg/s/K", "chamber_lead"),
        ),
        where=(
            ("Tdot", "sum(k * T(t + k * h) for k in upto(-m, m)) / (h / 60 * sum(k**2 for k in upto(-m, m)))"),
            ("m", "round(tau_s / (2 * h))"),
            ("h", "10"),
        ),
        others=(
            Symbol("Tdot", "slope of the line through the thermometer over the last and the next readings", "K/min"),
            Symbol("k", "place of a temperature, before or after", ""),
            Symbol("h", "spacing of the temperatures", "s"),
            Symbol("m", "number of temperatures on either side", "1"),
        ),
    )
    sources: ClassVar = (
        Source(
            "D. M. Shupe, Thermally induced nonreciprocity in the fiber-optic interferometer, Applied Optics 19(5), "
            "1980, pp. 654-655",
            "the error is proportional to the rate of change of the temperature along the fibre",
        ),
        Source(IEEE_952, "model equation, term D_T' T'", "definition"),
    )

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
        Parameter(
            "width_k",
            "K",
            1.0,
            15.0,
            logarithmic=True,
            symbol="W",
            meaning="width of the play: how far the temperature turns back before the state changes sides",
        ),
        Parameter(
            "bowed",
            "1",
            0,
            1,
            meaning="1: the loop closes at both ends of the range of temperatures; 0: it is equally wide everywhere",
        ),
        Parameter("rounded", "1", 0, 1, meaning="1: the state nears its new side exponentially; 0: in a straight line"),
    )
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.2), "piezo": (0.0, 0.2)}
    experiment = "temperatures on the way up and on the way down, then a smaller loop"
    draws = ("legs", "temperature_c")
    equation: ClassVar = Equation(
        "b * h * (4 * q * (1 - q) if bowed else 1)",
        (Symbol("b", "half the width of the loop in the bias", "deg/s", "leg"),),
        where=(
            ("h", "sum(p[i] * P(r[i] * W) for i in upto(1, 4)) if rounded else P(W)"),
            ("P(W)", "(T - T_p) / (W / 2)"),
            ("T_p", "min(max(T_b, T - W / 2), T + W / 2)"),
            ("q", "(T - T_min) / (T_max - T_min)"),
        ),
        others=(
            Symbol("h", "state of the hysteresis: 1 when approached from below, -1 from above", "1"),
            Symbol("P", "play of width W", "1"),
            Symbol("T_p", "follower with play; at the start the temperature", "deg C"),
            Symbol("T_b", "the follower one step of 10 s before", "deg C"),
            Symbol("i", "number of a play", ""),
            Symbol("r[i]", "nodes of the Gauss quadrature with the weight r exp(-r)", "1"),
            Symbol("p[i]", "weights of that quadrature", "1"),
            Symbol("q", "share of the range of temperatures, between 0 and 1", "1"),
            Symbol("T_min", "lowest temperature of the recording", "deg C", "low_c"),
            Symbol("T_max", "highest temperature of the recording", "deg C", "high_c"),
        ),
    )
    sources: ClassVar = (
        Source(
            "M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis, Springer 1989",
            "play, and Ishlinskii's material: a sum of plays",
        ),
        term_528("hysteresis error"),
    )

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
    parameters = (
        Parameter(
            "tau_s",
            "s",
            100.0,
            7200.0,
            logarithmic=True,
            symbol="tau",
            meaning="time constant of the settling after power-on",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.1), "mems": (0.0, 0.5), "piezo": (0.0, 2.0)}
    experiment = "a power cycle at constant temperature, and a wait of five time constants"
    draws = ("power_s", "time")
    equation: ClassVar = Equation(
        "b * exp(-t_on / tau)",
        (Symbol("b", "change of the bias after power-on", "deg/s", "warm_up"),),
    )
    sources: ClassVar = (term_528("warm-up time"),)

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
    parameters = (
        Parameter(
            "tau_s",
            "s",
            300.0,
            3600.0,
            logarithmic=True,
            symbol="tau",
            meaning="time constant of the warming by the unit's own power",
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.05), "mems": (0.0, 0.5), "piezo": (0.0, 5.0)}
    experiment = "compare the gyro's thermometer with the chamber's at rest, long after power-on"
    draws = ("power_s", "time")
    equation: ClassVar = Equation(
        "(b + s * omega[a]) * exp(-t_on / tau)",
        (
            Symbol("b", "change of the bias while the unit warms itself", "deg/s", "self_heating"),
            Symbol("s", "change of the scale factor while the unit warms itself", "1", "self_heating_rate"),
        ),
    )
    sources: ClassVar = (Source(WEISS, "drift of the offset, mostly self-heating", "definition"),)

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
    equation: ClassVar = Equation(
        "(b + s * omega[a]) * (T - T_ref)",
        (
            Symbol("b", "temperature coefficient of the bias", "deg/s/K", "thermometer"),
            Symbol("s", "temperature coefficient of the scale factor", "1/K", "thermometer_rate"),
        ),
    )
    sources: ClassVar = (
        Source(
            IEEE_952,
            "model equation, terms over temperature, with the error of the thermometer as dT",
            "definition",
        ),
    )

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
