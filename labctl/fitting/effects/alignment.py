"""Alignment: a gyro feels turning about axes that are not its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Rows, Term
from labctl.fitting.effects.equation import YANG, Equation, Source, Symbol, term_528

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class Misalignment(Effect):
    """Input axis misalignment."""

    id = "misalignment"
    term = "Input axis misalignment"
    sentence = "The gyro's input axis is tilted, so the output contains a part of the rate about the other axes."
    origin: ClassVar[Origin] = "package"
    rows: ClassVar[Rows] = "cross"
    ranges: ClassVar = {"fog": (0.0017, 0.017), "mems": (0.0017, 0.02), "piezo": (0.0017, 0.017)}
    aliases = ("non_orthogonality",)
    experiment = "remove and refit the unit at least three times: the part that changes is due to the fixture"
    draws = ("table_rate_dps", "map")
    equation: ClassVar = Equation(
        "sum(m[a, j] * omega[j] for j in others(a))",
        (
            Symbol(
                "m[a, j]",
                "part of the rate about axis j in output a: for small angles the angle, rad",
                "1",
                "misalignment_{j}",
            ),
        ),
    )
    sources: ClassVar[tuple[Source, ...]] = (
        Source(YANG, "error model, output = K rate + B: other entries of K"),
        term_528("input-axis misalignment"),
    )

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [
            Column(f"misalignment_{other}", "1", channels.rates[other])
            for other in BODY_AXES
            if other != axis and other in channels.rates
        ]


class NonOrthogonality(Misalignment):
    """Non-orthogonality of the input axes."""

    id = "non_orthogonality"
    term = "Non-orthogonality of the input axes"
    sentence = (
        "The input axes are not perpendicular to each other; the nine numbers of the matrix cannot distinguish this "
        "from misalignment."
    )
    aliases = ("misalignment",)
    experiment = "an external alignment cube"
    draws = ("table_rate_dps", "map")
    sources: ClassVar[tuple[Source, ...]] = (
        Source(YANG, "error model: the matrix of non-orthogonality is a factor of K, so that K contains it"),
    )


EFFECTS: tuple[type[Effect], ...] = (Misalignment, NonOrthogonality)
