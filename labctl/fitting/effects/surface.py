"""The two-variable polynomial of Ojeda, Chung and Borenstein (ICRA 2000, eqs. 10 to 12)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.effects.base import Column, Effect, Reference, Term, powers
from labctl.json_types.models import Origin

TEMPERATURE_ORDER = 2


def surface_unit(rate_power: int, temperature_power: int) -> str:
    """Return the unit of the coefficient of rate^i x temperature^j."""
    rate = {0: "deg/s", 1: "1"}.get(rate_power, f"(deg/s)^-{rate_power - 1}")
    return rate if temperature_power == 0 else f"{rate} K^-{temperature_power}"


class RateTemperatureSurface(Effect):
    """Error as a polynomial in rate and temperature; the order is the rate's, the temperature's is 2."""

    id = "rate_temperature_surface"
    term = "Bias and scale factor surface over rate and temperature"
    sentence = "The error is a smooth surface over rate and temperature: a cubic along one, a parabola along the other."
    by_temperature = True
    origin: ClassVar[Origin] = "sensor"
    default_order = 3
    max_order = 5
    experiment = "nothing to separate: it holds bias, scale factor and nonlinearity with their temperature terms"
    draws = ("map", "table_rate_dps", "temperature_c")

    def columns(self, channels: Channels, axis: str, term: Term, reference: Reference) -> list[Column]:
        rate, centred = channels.rate_dps(axis), channels.temperature_c(axis) - reference.temperature_c
        ones = np.ones(len(channels))
        of_rate = {0: ones, **powers(rate, range(1, self.order(term) + 1))}
        of_temperature = {0: ones, **powers(centred, range(1, TEMPERATURE_ORDER + 1))}
        return [
            Column(f"c_r{i}_t{j}", surface_unit(i, j), of_rate[i] * of_temperature[j])
            for i in of_rate
            for j in of_temperature
        ]

    def least(self, term: Term) -> tuple[int, int]:
        return self.order(term) + 1, TEMPERATURE_ORDER + 1


EFFECTS: tuple[type[Effect], ...] = (RateTemperatureSurface,)
