"""Units in which a described instrument states temperatures, angles, rates and accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Unit -> factor and offset to deg C.
TEMPERATURES = {"deg C": (1.0, 0.0), "K": (1.0, -273.15), "deg F": (5 / 9, -160 / 9)}
#: Unit of an angle -> degrees.
ANGLES = {"deg": 1.0, "mdeg": 1e-3, "arcmin": 1 / 60, "arcsec": 1 / 3600, "rad": math.degrees(1.0), "turn": 360.0}
#: Unit of a rate -> deg/s; of an acceleration -> deg/s2.
RATES = {f"{unit}/s": factor for unit, factor in ANGLES.items()} | {"rpm": 6.0}
ACCELERATIONS = {f"{unit}/s2": factor for unit, factor in ANGLES.items()}
#: A unit of a controller that counts steps or lines of an encoder; `counts_per_turn` says how many make a turn.
COUNT = "count"


@dataclass(frozen=True)
class Unit:
    """A number of the instrument times `factor`, plus `offset`, is in labctl's own unit."""

    factor: float = 1.0
    offset: float = 0.0

    def read(self, number: float) -> float:
        """Return a number of the instrument in labctl's own unit."""
        return number * self.factor + self.offset

    def written(self, value: float) -> float:
        """Return a value in labctl's own unit as the number that the instrument takes."""
        return (value - self.offset) / self.factor


def temperature_unit(name: str) -> Unit:
    """Return a unit of temperature; raises ValueError."""
    if name not in TEMPERATURES:
        raise ValueError(f"unit {name!r} of temperature is not known; choose one of {', '.join(TEMPERATURES)}")
    return Unit(*TEMPERATURES[name])


def turning_unit(quantity: str, name: str, units: dict[str, float], suffix: str, counts_per_turn: float | None) -> Unit:
    """Return a unit of angle, rate or acceleration; raises ValueError. `suffix` is what `units` has behind an angle."""
    if name == f"{COUNT}{suffix}":
        if counts_per_turn is None:
            raise ValueError(f"unit {name!r} of {quantity} needs counts_per_turn: the counts of one whole turn; add it")
        return Unit(360.0 / counts_per_turn)
    if name not in units:
        raise ValueError(
            f"unit {name!r} of {quantity} is not known; choose one of {', '.join([*units, COUNT + suffix])}"
        )
    return Unit(units[name])
