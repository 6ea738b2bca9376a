"""The effect as a fit sees it."""

from __future__ import annotations

from typing import ClassVar

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects import Column, Effect, Reference, Term
from labctl.fitting.effects.base import Origin, Rows

USUAL_PCT = 45.0


class HumiditySensitivity(Effect):
    """Bias humidity sensitivity."""

    id = "humidity_sensitivity"
    term = "Bias humidity sensitivity"
    sentence = "The output at rest follows the relative humidity."
    origin: ClassVar[Origin] = "sensor"
    rows: ClassVar[Rows] = "all"
    needs = ("humidity_pct",)
    shows_at_rest = True
    experiment = "hold rate and temperature, and change the humidity"
    draws = ("humidity_pct",)

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        """Return one regressor: the deviation of the humidity from its usual value, per cent."""
        return [Column("humidity", "deg/s/%", channels["humidity_pct"] - USUAL_PCT)]
