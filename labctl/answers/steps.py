"""The steps of a plan, as they are written down."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class StepJson(TypedDict):
    """One step of a plan; the keys below `expected_s` belong to some kinds of steps only."""

    kind: str
    """Kind of the step."""
    expected_s: float
    """Expected duration, s."""
    temperature_c: NotRequired[float | None]
    """Temperature of the chamber, deg C; null or absent: none."""
    rate_dps: NotRequired[float | None]
    """Rate of the table, deg/s; null or absent: none."""
    turn_deg: NotRequired[float | None]
    """Angle of a turn, positive counter-clockwise seen from above, deg; null or absent: none."""
    position: NotRequired[str | None]
    """Position of the unit: the body axis that points up, such as -x; null or absent: none."""
    dataset: NotRequired[int | None]
    """Number of the data set that the step takes; null or absent: none."""
