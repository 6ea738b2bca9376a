"""What surrounds the gyro and is logged: the supply voltage."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Rows, Term
from labctl.fitting.effects.equation import IEEE_952, Equation, Source, Symbol

if TYPE_CHECKING:
    from labctl.answers.effect_origin import Origin


class SupplySensitivity(Effect):
    """Supply sensitivity."""

    id = "supply_sensitivity"
    term = "Supply voltage sensitivity"
    sentence = "The bias follows the supply voltage."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    shows_at_rest = True
    needs = ("supply_v",)
    ranges: ClassVar = {"fog": (0.0, 0.02), "mems": (0.0, 0.2), "piezo": (0.0, 50.0)}
    experiment = "steps of 5 % in the supply, at rest and at one rate"
    draws = ("supply_v", "time")
    equation: ClassVar = Equation(
        "b * V",
        (Symbol("b", "change of the bias per volt of the supply", "deg/s/V", "supply"),),
    )
    sources: ClassVar = (Source(IEEE_952, "sensitivity to the supply voltage", "definition"),)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        return [Column("supply", "deg/s/V", np.asarray(channels["supply_v"], dtype=np.float64))]


EFFECTS: tuple[type[Effect], ...] = (SupplySensitivity,)
