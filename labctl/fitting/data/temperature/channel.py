"""Which temperature a fit and a criticism go by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.recording import Columns, Recording
from labctl.recording.recording import temperature_of

#: The temperature of a unit without a thermometer, deg C: no answer shows it.
STAND_IN_C = 25.0


def with_temperature(recording: Recording) -> Recording:
    """Return a recording that has `temperature_c`, by which fit and criticism go.

    Where the unit has no thermometer the chamber's temperature stands in for it (`temperature_of`), in the history too:
    one thermometer for all. A recording of a motion that needs no thermometer stays without one (`with_stand_in`).
    Raises NotEnoughData where neither is there and the unit was turned by a table at rates that a law of temperature is
    fitted to.
    """
    columns, environment = recording.columns, recording.environment
    if "temperature_c" in columns:
        return recording
    temperature_c = temperature_of(columns)
    if temperature_c is None and recording.info.motion != "rates":
        return recording
    if temperature_c is None:
        raise NotEnoughData(
            f"{recording.info.serial}: columns 'temperature_c' and 'chamber_c' are both missing; add one of the two"
        )
    if environment is not None:
        theirs = {name: values for name, values in environment.items() if name != "temperature_c"}
        known_c = temperature_of(theirs)
        environment = None if known_c is None else {**theirs, "temperature_c": known_c}
    return replace(recording, columns={**columns, "temperature_c": temperature_c}, environment=environment)


def with_stand_in(columns: Mapping[str, NDArray[np.generic]], n: int) -> dict[str, NDArray[np.generic]]:
    """Return the columns, n rows each, of channels: where no thermometer is known, one temperature for all rows.

    A law of temperature then cannot be seen (`TemperatureHistory.thermometer`); all others can.
    """
    return dict(columns) if "temperature_c" in columns else {**columns, "temperature_c": np.full(n, STAND_IN_C)}


def is_chambers(columns: Columns) -> bool:
    """Whether the chamber's temperature stands in for the unit's."""
    return "chamber_c" in columns and np.array_equal(columns["temperature_c"], columns["chamber_c"])
