"""Tilted mountings in a recipe: which are read, which a bench can do, and where the temperature moves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from pydantic import ValidationError

from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, Mount, MoveChamber
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe

RAMP = {"from_c": 20.0, "to_c": 30.0, "rates_dps": [0.0, 5.0], "dwell_s": 60.0, "back": True}


def recipe(**changes: Any) -> Recipe:
    values: dict[str, Any] = {"temperatures_c": [20], "rates_dps": [0, 5], "positions": ["x", "x+y+z"]}
    return Recipe.model_validate({"name": "r", **values, **changes})


def test_a_tilted_mounting_needs_a_fixture_that_brings_its_direction_up(limits: BenchLimits) -> None:
    with pytest.raises(
        PlanRefused, match=r"positions x\+y\+z: the bench states no tilted fixture.*tilted_positions = "
    ):
        make_plan(recipe(), limits)
    has = replace(limits, tilted_positions=("x+y+z",))
    plan = make_plan(recipe(positions=["x", "z+y+x"]), has)
    assert [step.position for step in plan.steps if isinstance(step, Mount)] == ["x", "x+y+z"]
    with pytest.raises(PlanRefused, match=r"positions -x-y-z: the bench states no tilted fixture"):
        make_plan(recipe(inverted={"temperatures_c": [20], "rates_dps": [5]}), has)


def test_a_tilted_unit_is_not_turned_about_the_table_axis(limits: BenchLimits) -> None:
    has = replace(limits, tilted_positions=("x+y+z",))
    turned = {"unit_deg": [180], "temperatures_c": [20], "rates_dps": [5]}
    plan = make_plan(recipe(indexing=turned), has)
    assert [step.position for step in plan.steps if isinstance(step, Mount)] == ["x", "x@180", "x+y+z"]


def moving(plan: Plan) -> set[str]:
    """Return the positions in which data are taken after a move that is not waited for."""
    found, moves = set(), False
    for step in plan.steps:
        if isinstance(step, MoveChamber):
            moves = not step.wait
        elif isinstance(step, Acquire) and moves:
            found.add(step.position)
    return found


def test_the_temperature_moves_in_the_mountings_that_are_named(limits: BenchLimits) -> None:
    has = replace(limits, tilted_positions=("x+y+z",))
    everywhere, named = (
        make_plan(recipe(ramp={**RAMP, **where}), has)
        for where in ({}, {"positions": ["x+y+z"], "first_dwell_s": 600.0})
    )
    assert moving(everywhere) == {"x", "x+y+z"}
    assert moving(named) == {"x+y+z"}
    of_tilted = [step for step in named.steps if isinstance(step, Acquire) and step.position == "x+y+z"]
    assert sum(step.expected_s for step in of_tilted) > 600.0  # the first of the mountings that move, not of the recipe


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"positions": ["x@180"]}, r"turns about the table axis in its table \[indexing\]"),
        ({"positions": ["w"]}, "is not a position"),
        ({"positions": [1]}, "valid string"),
        ({"ramp": {**RAMP, "positions": ["y"]}}, r"ramp.positions: y is none of the positions of the recipe"),
    ],
)
def test_what_no_mounting_is_has_a_clear_error(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        recipe(**changes)


def test_a_hand_turns_no_tilted_unit() -> None:
    with pytest.raises(ValidationError, match=r"x\+y\+z is tilted, and a hand turns units about a body axis"):
        Recipe.model_validate({"name": "r", "positions": ["z", "x+y+z"], "turns": {"turns_deg": [360]}})
