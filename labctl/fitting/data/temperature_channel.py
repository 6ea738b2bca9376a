"""Which temperature a fit and a criticism go by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from labctl.errors import NotEnoughData
from labctl.recording import Columns, Recording
from labctl.recording.points import temperature_of


def with_temperature(recording: Recording) -> Recording:
    """Return a recording that has `temperature_c`, by which fit and criticism go.

    Where the unit has no thermometer the chamber's temperature stands in for it (`temperature_of`), in the history too:
    one thermometer for all. Raises NotEnoughData where there is neither.
    """
    columns, environment = recording.columns, recording.environment
    if "temperature_c" in columns:
        return recording
    warm = temperature_of(columns)
    if warm is None:
        raise NotEnoughData(
            f"{recording.info.serial}: column 'temperature_c' is missing, and so is 'chamber_c', which can replace "
            "it; add one of the two"
        )
    if environment is not None:
        theirs = {name: values for name, values in environment.items() if name != "temperature_c"}
        there = temperature_of(theirs)
        environment = None if there is None else {**theirs, "temperature_c": there}
    return replace(recording, columns={**columns, "temperature_c": warm}, environment=environment)


def is_chambers(columns: Columns) -> bool:
    """Whether the chamber's temperature stands in for the unit's."""
    return "chamber_c" in columns and np.array_equal(columns["temperature_c"], columns["chamber_c"])
