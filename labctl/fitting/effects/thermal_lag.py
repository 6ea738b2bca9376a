"""Thermal lag: bias and scale factor as the answer of one or two heat flows from thermometer to sensing element.

An element behind the thermometer follows it as dT_g/dt = (T_m - T_g) / tau, and the error of the bias, or of the scale
factor, is what its law of temperature gives at T_g less what it gives at T_m. Elements of one package have time
constants of their own, so each axis may have one; two flows, a flow that is faster one way, and a curved law of
temperature are further columns.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import Equation, Source, Symbol
from labctl.fitting.numeric.arrays import Array

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin

#: What makes the error: the distance between element and thermometer, or that of the squares of their temperatures.
Part = Literal["all", "curved"]
#: Time constants that are tried, s: of an element in its package to a whole case.
SHORTEST_S, LONGEST_S = 20.0, 6000.0
#: Time constant where a term states none, s.
USUAL_S = 600.0

#: Equations of the sensing elements, and what stands in them.
LINES = (
    ("d(T_g)/d(t)", "(T - T_g) / tau_T"),
    ("tau_T", "tau_c if T_g > T else tau"),
    ("d(T_2)/d(t)", "(T - T_2) / tau_2"),
)
SYMBOLS = (
    Symbol("T_g", "temperature of the sensing element; at the start that of the thermometer", "deg C"),
    Symbol("T_2", "temperature of a second element", "deg C"),
    Symbol("tau_T", "time constant in this direction; tau in both unless cooling_tau_s is given", "s"),
)
SOURCES = (
    Source(
        "F. P. Incropera and others, Fundamentals of Heat and Mass Transfer",
        "section 5.1, lumped capacitance method: the equation of T_g",
    ),
)


@dataclass(frozen=True)
class LagElement:
    """One column of a lag on one axis: what it is called, what of the lag it takes, and the time constant."""

    column: str
    unit: str
    part: Part
    tau_s: float
    cooling_tau_s: float | None = None  #: while the element is the warmer one, where that is another

    def values(self, behind_k: Array, above_k: Array) -> Array:
        """Return the column (n,) of an element `behind_k` (its temperature less the thermometer's, K).

        `above_k` is the thermometer's temperature less the reference, (n,) K.
        """
        return behind_k * (behind_k + 2.0 * above_k) if self.part == "curved" else behind_k


def tau_of(term: Term, name: str, axis: str) -> float | None:
    """Return a time constant of a term on an axis, s: `tau_x_s`, or `tau_s` for all axes; None where it has none."""
    common = term.parameters.get(f"{name}_s")
    return term.parameters.get(f"{name}_{axis}_s", common)


def lag_elements(term: Term, axis: str) -> list[LagElement]:
    """Return the columns of a term on an axis, in order."""
    name, unit = term.effect, "1/K" if term.effect == ScaleFactorLag.id else "deg/s/K"
    tau_s = tau_of(term, "tau", axis) or USUAL_S
    elements = [LagElement(name, unit, "all", tau_s, tau_of(term, "cooling_tau", axis))]
    if (second := tau_of(term, "second_tau", axis)) is not None:
        elements.append(LagElement(f"{name}_second", unit, "all", second))
    if term.parameters.get(f"curved_{axis}", term.parameters.get("curved", 0.0)):
        elements.append(LagElement(f"{name}_curved", f"{unit}2", "curved", tau_s, elements[0].cooling_tau_s))
    return elements


class Lag(Effect):
    """What the lag of the bias and that of the scale factor have in common."""

    remembers = True
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    needs = ("t_s",)
    parameters = (
        Parameter(
            "tau_s",
            "s",
            SHORTEST_S,
            LONGEST_S,
            logarithmic=True,
            symbol="tau",
            meaning="time constant with which the sensing element follows the thermometer",
        ),
        Parameter(
            "second_tau_s",
            "s",
            SHORTEST_S,
            LONGEST_S,
            logarithmic=True,
            symbol="tau_2",
            optional=True,
            meaning="time constant of a second element; left out: there is none",
        ),
        Parameter(
            "cooling_tau_s",
            "s",
            SHORTEST_S,
            LONGEST_S,
            logarithmic=True,
            symbol="tau_c",
            optional=True,
            meaning="time constant while the element is warmer than the thermometer; left out: the same",
        ),
        Parameter(
            "curved", "1", 0, 1, meaning="1: the temperature law is curved, one coefficient more; 0: it is straight"
        ),
    )
    draws = ("legs", "time")

    @abstractmethod
    def factor(self, channels: Channels, axis: str) -> Array:
        """Return what the temperature difference is multiplied by: (n,) ones of a bias, the rate of a scale factor."""

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        above_k, factor = channels.temperature_c(axis) - reference.temperature_c, self.factor(channels, axis)
        behind = [channels.history.lag_k(channels.columns, e.tau_s, e.cooling_tau_s) for e in lag_elements(term, axis)]
        return [
            Column(e.column, e.unit, factor * e.values(behind_k, above_k))
            for e, behind_k in zip(lag_elements(term, axis), behind, strict=True)
        ]

    def states_shape(self, term: Term) -> bool:
        """Return whether a term has a time constant, of all axes or of one."""
        return any(name.endswith("_s") for name in term.parameters)

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, tau_s=np.geomspace(150.0, 3600.0, 7))


class ThermalLag(Lag):
    """Thermal lag between the sensing part and the thermometer."""

    id = "thermal_lag"
    term = "Thermal lag (sensing element behind the thermometer)"
    sentence = (
        "The sensing element follows the thermometer with a delay, so the correction is made for another temperature."
    )
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    ranges: ClassVar = {"fog": (0.0, 0.02), "mems": (0.0, 0.1), "piezo": (0.0, 0.6)}
    experiment = "two ramp speeds: an error due to lag grows with the speed, an error due to hysteresis does not"
    equation: ClassVar = Equation(
        "b * (T_g - T) + b_2 * (T_2 - T) + b_c * ((T_g - T_ref)**2 - (T - T_ref)**2)",
        (
            Symbol("b", "temperature coefficient of the bias", "deg/s/K", "thermal_lag"),
            Symbol("b_2", "the same of the second element; only with second_tau_s", "deg/s/K", "thermal_lag_second"),
            Symbol("b_c", "curvature of the bias over temperature; only with curved", "deg/s/K2", "thermal_lag_curved"),
        ),
        where=LINES,
        others=SYMBOLS,
    )
    sources: ClassVar = SOURCES

    def factor(self, channels: Channels, axis: str) -> Array:
        return np.ones(len(channels))


class ScaleFactorLag(Lag):
    """Thermal lag of the scale factor: the element that scales the rate is behind the thermometer."""

    id = "scale_factor_lag"
    term = "Thermal lag of the scale factor"
    sentence = (
        "The scale factor follows the thermometer with a delay: while the temperature changes, it is that of another "
        "temperature."
    )
    ranges: ClassVar = {"fog": (0.0, 1e-3), "mems": (0.0, 5e-4), "piezo": (0.0, 2e-4)}
    experiment = "the same rates during a ramp of the temperature and after it, on the way up and on the way down"
    equation: ClassVar = Equation(
        "omega[a] * (s * (T_g - T) + s_2 * (T_2 - T) + s_c * ((T_g - T_ref)**2 - (T - T_ref)**2))",
        (
            Symbol("s", "temperature coefficient of the scale factor", "1/K", "scale_factor_lag"),
            Symbol("s_2", "the same of the second element; only with second_tau_s", "1/K", "scale_factor_lag_second"),
            Symbol(
                "s_c",
                "curvature of the scale factor over temperature; only with curved",
                "1/K2",
                "scale_factor_lag_curved",
            ),
        ),
        where=LINES,
        others=SYMBOLS,
    )
    sources: ClassVar = SOURCES

    def factor(self, channels: Channels, axis: str) -> Array:
        return channels.rate_dps(axis)


LAGS: tuple[type[Lag], ...] = (ThermalLag, ScaleFactorLag)
