"""The steps of a plan, as they are written down."""

from __future__ import annotations

from typing import NotRequired

from typing_extensions import TypedDict


class StepJson(TypedDict):
    """One step: its kind, how long it takes as a rule, and what belongs to the kind, of which these keys are read."""

    kind: str
    expected_s: float
    temperature_c: NotRequired[float | None]
    rate_dps: NotRequired[float | None]
    turn_deg: NotRequired[float | None]
    position: NotRequired[str | None]
    dataset: NotRequired[int | None]
