"""Bias: what the gyro says at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Rows, Span, Term, powers
from labctl.fitting.effects.equation import IEEE_952, OJEDA, WEISS, YANG, Equation, Source, Symbol, term_528

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class Bias(Effect):
    """Zero-rate output."""

    id = "bias"
    term = "Bias (zero-rate output)"
    sentence = "The gyro reports a constant rate while it stands still."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    ranges: ClassVar = {"fog": (0.0, 0.02), "mems": (0.0, 3.0), "piezo": (0.0, 5.0)}
    experiment = "input axis up, then down, table clamped: half the sum is bias, half the difference is not"
    draws = ("map",)
    equation: ClassVar = Equation(
        "b",
        (Symbol("b", "bias", "deg/s", "bias"),),
    )
    sources: ClassVar = (
        term_528("bias"),
        Source(YANG, "error model, output = K rate + B: bias B"),
        Source(IEEE_952, "model equation, term D_F", "definition"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("bias", "deg/s", np.ones(len(channels)))]


class BiasTemperature(Effect):
    """Bias temperature sensitivity."""

    id = "bias_temperature"
    term = "Bias temperature sensitivity"
    sentence = "The output at rest changes with the gyro's temperature."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    default_order = 2
    max_order = 5
    ranges: ClassVar = {"fog": (0.0, 0.01), "mems": (0.005, 0.08), "piezo": (0.05, 0.63)}
    experiment = "measure the temperatures in the opposite order and repeat one of them at the end"
    draws = ("temperature_c", "map")
    equation: ClassVar = Equation(
        "sum(b[k] * (T - T_ref)**k for k in upto(1, n))",
        (Symbol("b[k]", "temperature coefficient of the bias of power k", "deg/s/K^k", "bias_t{k}"),),
    )
    sources: ClassVar = (
        Source(OJEDA, "Eq. 4 (a parabola at one rate)"),
        Source(IEEE_952, "model equation, term D_T", "definition"),
        Source(WEISS, "table of the offset over temperature", "definition"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        centred = channels.temperature_c(axis) - reference.temperature_c
        return [
            Column(f"bias_t{k}", f"deg/s/K^{k}" if k > 1 else "deg/s/K", column)
            for k, column in powers(centred, range(1, self.order(term) + 1)).items()
        ]

    def least(self, term: Term) -> tuple[int, int]:
        return 1, self.order(term) + 1

    def options(self, span: Span) -> list[Term]:
        return [Term(self.id, order) for order in (1, 2, 3)]  # a higher one would follow any curve


EFFECTS: tuple[type[Effect], ...] = (Bias, BiasTemperature)
