"""Thermal lag: the bias as the answer of one or two heat flows between the thermometer and the sensing element.

An element behind the thermometer follows it as dT_g/dt = (T_m - T_g) / tau, and the error of the bias is what the law
of temperature gives at T_g less what it gives at T_m. Elements of one package have time constants of their own, so each
axis may have one; two flows, a flow that is faster one way, and a curved law of temperature are further columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.numeric.arrays import Array
from labctl.json_types.models import Origin

#: What makes the error: the distance between element and thermometer, or that of the squares of their temperatures.
Part = Literal["all", "curved"]
#: Time constants that are tried, s: of an element in its package to a whole case.
SHORTEST_S, LONGEST_S = 20.0, 6000.0
#: Time constant where a term states none, s.
USUAL_S = 600.0


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
    tau_s = tau_of(term, "tau", axis) or USUAL_S
    found = [LagElement("thermal_lag", "deg/s/K", "all", tau_s, tau_of(term, "cooling_tau", axis))]
    if (second := tau_of(term, "second_tau", axis)) is not None:
        found.append(LagElement("thermal_lag_second", "deg/s/K", "all", second))
    if term.parameters.get("curved", 0.0):
        found.append(LagElement("thermal_lag_curved", "deg/s/K2", "curved", tau_s, found[0].cooling_tau_s))
    return found


class ThermalLag(Effect):
    """Thermal lag between the sensing part and the thermometer."""

    id = "thermal_lag"
    remembers = True
    term = "Thermal lag (sensing element behind the thermometer)"
    sentence = (
        "The sensing element follows the thermometer with a delay, so the correction is made for another temperature."
    )
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("t_s",)
    parameters = (
        Parameter("tau_s", "s", SHORTEST_S, LONGEST_S, logarithmic=True),
        Parameter("second_tau_s", "s", SHORTEST_S, LONGEST_S, logarithmic=True),
        Parameter("cooling_tau_s", "s", SHORTEST_S, LONGEST_S, logarithmic=True),
        Parameter("curved", "1", 0, 1),
    )
    ranges: ClassVar = {"fog": (0.0, 0.02), "mems": (0.0, 0.1), "piezo": (0.0, 0.6)}
    experiment = "two ramp speeds: an error due to lag grows with the speed, an error due to hysteresis does not"
    draws = ("legs", "time")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        above_k = channels.temperature_c(axis) - reference.temperature_c
        return [
            Column(
                e.column, e.unit, e.values(channels.history.lag_k(channels.columns, e.tau_s, e.cooling_tau_s), above_k)
            )
            for e in lag_elements(term, axis)
        ]

    def states_shape(self, term: Term) -> bool:
        """Return whether a term has a time constant, of all axes or of one."""
        return any(name.endswith("_s") for name in term.parameters)

    def options(self, span: Span) -> list[Term]:
        return by_parameter(self.id, tau_s=np.geomspace(150.0, 3600.0, 7))
