"""Mountings that are turned about the table axis: where in a plan they come, and which angles a recipe may ask for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from pydantic import ValidationError

from procedures.contracts.steps import Acquire, Mount, Soak
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe


def acquires(plan: Plan) -> list[Acquire]:
    return [step for step in plan.steps if isinstance(step, Acquire)]


def recipe(**changes: Any) -> Recipe:
    values: dict[str, Any] = {"temperatures_c": [10, 20, 30], "rates_dps": [0, 5, -5], "positions": ["x", "y"]}
    return Recipe.model_validate({"name": "r", **values, **changes})


def test_turned_mountings_follow_theirs_in_the_same_session(limits: BenchLimits) -> None:
    turned = {"unit_deg": [180], "fixture_deg": [90], "temperatures_c": [25], "rates_dps": [50, -50], "hold_s": 0}
    asked = recipe(indexing=turned, inverted={"temperatures_c": [20], "rates_dps": [5]}, mounting={"handling_c": 30})
    plan = make_plan(asked, limits)
    mounted = [step.position for step in plan.steps if isinstance(step, Mount)]
    straight = list(asked.positions)
    assert mounted == [f"{end}" for each in straight for end in (each, f"{each}@180", f"{each}@0/90", f"-{each}")]
    on = [step for step in acquires(plan) if "@" in step.position]
    assert {(step.temperature_c, step.rate_dps) for step in on} == {(25.0, 50.0), (25.0, -50.0)}
    assert len(on) == 2 * 2 * len(straight)
    assert {step.run for step in acquires(plan)} == {1}
    held = {step.temperature_c: step.hold_s for step in plan.steps if isinstance(step, Soak)}
    assert held[25.0] == 0.0
    assert held[20.0] == asked.soak.hold_s


def test_clipping_reaches_the_turned_mountings(limits: BenchLimits) -> None:
    slow = replace(limits, table=replace(limits.table, max_rate_dps=40), gyros={})
    turned = {"unit_deg": [180], "temperatures_c": [20], "rates_dps": [5, 50]}
    plan = make_plan(recipe(indexing=turned), slow, clip=True)
    assert "indexing.rates_dps 50: beyond the 40 deg/s of the table" in plan.clipped


@pytest.mark.parametrize(
    ("turned", "said"),
    [
        ({}, "nothing is turned; give unit_deg or fixture_deg"),
        ({"unit_deg": [180, 180]}, "an angle is given twice"),
        ({"unit_deg": [0]}, "unit_deg"),
        ({"unit_deg": [360]}, "unit_deg"),
        ({"fixture_deg": [90.5]}, "fixture_deg"),
    ],
)
def test_angles_that_turn_nothing_are_refused(turned: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        recipe(indexing={**turned, "temperatures_c": [20], "rates_dps": [5]})
