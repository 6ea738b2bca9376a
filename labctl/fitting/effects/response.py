"""What the output is late by and how fast it can follow: seen only while the rate changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.response import DELAY, TIME_CONSTANT, Response
from labctl.fitting.effects.base import Column, Effect, Law, Parameter, Reference, Rows, Span, Term, by_parameter
from labctl.fitting.effects.equation import Equation, Source, Symbol, term_528
from labctl.fitting.numeric.arrays import Array

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class _Responding(Effect):
    """A part of the response. Every other effect sees the rate that has come through the whole response."""

    in_use = False  # a delay cannot be undone reading by reading, nor can a finite bandwidth
    exact = True
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "own"
    name: ClassVar[str]

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return the change of the rate by a delay or time constant that differs from the channels' response."""
        profile, response = channels.profile, channels.response
        if profile is None:
            return [Column(self.name, "s", np.zeros(len(channels)))]
        up, present = channels.up(axis), response.value(self.name)
        value = term.parameters.get(self._parameter, present)

        def error_dps(coefficient: Array) -> Array:
            then = response.with_value(self.name, float(coefficient[0]) if len(coefficient) else present)
            return np.asarray(up * (profile.seen_dps(then) - profile.seen_dps(response)))

        def slope(coefficient: Array) -> Array:
            then = response.with_value(self.name, float(coefficient[0]) if len(coefficient) else present)
            return np.asarray(up * profile.slope(self.name, then))

        at = np.full(len(channels), value)
        shape = slope(at) if value == present else error_dps(at) / (value - present)
        return [Column(self.name, "s", shape, law=Law(error_dps, slope), start=value)]

    @property
    def _parameter(self) -> str:
        return self.parameters[0].name

    def shaped_by(self, term: Term, coefficients: Mapping[str, float]) -> Term:
        if not coefficients:
            return term
        mean = sum(coefficients.values()) / len(coefficients)
        return Term(term.effect, term.order, {self._parameter: mean}, term.formula, term.steady)

    def options(self, span: Span) -> list[Term]:
        (parameter,) = self.parameters
        return by_parameter(self.id, **{parameter.name: parameter.grid(8)})


class TimeDelay(_Responding):
    """Delay of the output."""

    id = "time_delay"
    term = "Time delay (latency)"
    sentence = "The output is delayed: while the rate changes, it is off by the delay times the angular acceleration."
    name = DELAY
    parameters = (
        Parameter(
            "delay_s", "s", 2e-4, 0.1, logarithmic=True, symbol="delta", meaning="delay of the output", refined=True
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.0, 0.03), "piezo": (0.0, 0.03)}
    experiment = (
        "a sine sweep up to the bandwidth: a delay leaves the amplitude of the output unchanged, a low bandwidth "
        "reduces it"
    )
    draws = ("time",)
    equation: ClassVar = Equation(
        "omega_a(t - delta) - omega_a(t)",
        (Symbol("delta", "delay of the output", "s", "delay"),),
        others=(Symbol("omega_a", "rate about the axis as a function of the time", "deg/s"),),
    )
    sources: ClassVar = (
        Source(
            "A. V. Oppenheim, A. S. Willsky, Signals and Systems, 2nd ed., Prentice Hall 1997",
            "time shift: the frequency response exp(-i w delta)",
        ),
    )


class Bandwidth(_Responding):
    """Finite bandwidth of the output."""

    id = "bandwidth"
    term = "Bandwidth (first-order response)"
    sentence = "The output follows the rate like a first-order low-pass filter: fast changes are delayed and reduced."
    name = TIME_CONSTANT
    parameters = (
        Parameter(
            "time_constant_s",
            "s",
            2e-4,
            0.1,
            logarithmic=True,
            symbol="tau",
            meaning="time constant of the output",
            refined=True,
        ),
    )
    ranges: ClassVar = {"fog": (0.0, 0.005), "mems": (0.0, 0.02), "piezo": (0.0, 0.05)}
    experiment = (
        "a sine sweep up to the bandwidth: a delay leaves the amplitude of the output unchanged, a low bandwidth "
        "reduces it"
    )
    draws = ("time",)
    equation: ClassVar = Equation(
        "omega_l - omega[a]",
        (Symbol("tau", "time constant of the output; the bandwidth at -3 dB is 1 / (2 pi tau)", "s", "time_constant"),),
        where=(("d(omega_l)/d(t)", "(omega[a] - omega_l) / tau"),),
        others=(Symbol("omega_l", "rate behind the low-pass filter", "deg/s"),),
    )
    sources: ClassVar = (
        Source(
            "A. V. Oppenheim, A. S. Willsky, Signals and Systems, 2nd ed., Prentice Hall 1997",
            "first-order system: the frequency response 1 / (1 + i w tau)",
        ),
        term_528("bandwidth"),
    )


#: The effects of which the response is made.
IDS = frozenset({TimeDelay.id, Bandwidth.id})


def response_of_terms(terms: Iterable[Term]) -> Response:
    """Return the response that the terms of a model have as their parameters."""
    response = Response()
    for term in terms:
        if term.effect in IDS:
            for value in term.parameters.values():
                response = response.with_value(DELAY if term.effect == TimeDelay.id else TIME_CONSTANT, value)
    return response


EFFECTS: tuple[type[Effect], ...] = (TimeDelay, Bandwidth)
