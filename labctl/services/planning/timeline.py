"""The steps of a plan as columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

from labctl.answers.plans import TimelineColumns
from labctl.answers.steps import StepJson
from procedures.contracts.steps import Step


def step_json(step: Step) -> StepJson:
    """Return a step as it is written down."""
    return cast(StepJson, step.model_dump(mode="json"))


def timeline_columns(steps: Sequence[StepJson]) -> TimelineColumns:
    """Return the steps of a plan as columns; set point and position stay in force until the next."""
    start_s: list[float] = []
    temperature_c: list[float | None] = []
    position: list[str | None] = []
    now_s, now_c, now_position = 0.0, None, None
    for step in steps:
        now_c, now_position = step.get("temperature_c", now_c), step.get("position", now_position)
        start_s.append(now_s)
        temperature_c.append(now_c)
        position.append(now_position)
        now_s += step["expected_s"]
    return TimelineColumns(
        number=list(range(1, len(steps) + 1)),
        kind=[step["kind"] for step in steps],
        start_s=start_s,
        expected_s=[step["expected_s"] for step in steps],
        temperature_c=temperature_c,
        rate_dps=[step.get("rate_dps") for step in steps],
        turn_deg=[step.get("turn_deg") for step in steps],
        position=position,
        dataset=[step.get("dataset") for step in steps],
    )
