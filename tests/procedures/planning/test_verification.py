"""The verification part of a plan: other rates and temperatures, another mounting and another power-on, from a seed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import Any

import pytest

from procedures.contracts.errors import PlanRefused, RecipeError
from procedures.contracts.steps import Acquire, Mount, PowerOn, SafeState
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe, parse_recipe, read_recipe

RATES_DPS = [0.0, 10.0, -10.0, 100.0, -100.0, 300.0, -300.0]
TEMPERATURES_C = [0.0, 15.0, 30.0, 45.0]


def recipe(**changes: Any) -> Recipe:
    values: dict[str, Any] = {
        "name": "r", "temperatures_c": TEMPERATURES_C, "rates_dps": RATES_DPS, "positions": ["x", "-y", "z"],
        "verification": {"temperatures": 2, "rates": 6, "seed": 4},
    }  # fmt: skip
    return Recipe.model_validate(values | changes)


def parts(plan: Plan) -> tuple[list[Acquire], list[Acquire]]:
    """Return the data sets that are fitted, and those that verify."""
    sets = [step for step in plan.steps if isinstance(step, Acquire)]
    return [s for s in sets if not s.verification], [s for s in sets if s.verification]


def test_it_follows_the_rest_in_mountings_and_sessions_of_its_own(limits: BenchLimits) -> None:
    plan = make_plan(recipe(), limits)
    fitted, verified = parts(plan)
    assert (len(fitted), len(verified)) == (3 * 4 * 7, 3 * 2 * 6)
    assert min(s.dataset for s in verified) > max(s.dataset for s in fitted)
    assert [s.position for s in verified[::12]] == ["x", "-y", "z"]
    assert not {s.mounting for s in fitted} & {s.mounting for s in verified}
    assert not {s.run for s in fitted} & {s.run for s in verified}
    assert len({s.run for s in verified}) == 3
    assert isinstance(plan.steps[-1], SafeState)
    mounts = [step for step in plan.steps if isinstance(step, Mount)]
    assert len(mounts) == 6
    assert sum(isinstance(step, PowerOn) for step in plan.steps) == 1 + 3


def test_its_rates_and_temperatures_lie_between_those_that_are_fitted(limits: BenchLimits) -> None:
    fitted, verified = parts(make_plan(recipe(), limits))
    assert not {s.temperature_c for s in fitted} & {s.temperature_c for s in verified}
    levels = [(s.mounting, s.temperature_c) for s in verified[::6]]
    assert sorted(int(temperature / 7.5) for _, temperature in levels) == [0, 1, 2, 3, 4, 5]  # of 0 to 45 deg C
    for mounting, temperature in levels:
        rates = [s.rate_dps for s in verified if (s.mounting, s.temperature_c) == (mounting, temperature)]
        assert sorted(int((rate + 300.0) / 100.0) for rate in rates) == [0, 1, 2, 3, 4, 5]
    assert len({s.rate_dps for s in verified}) == len(verified)


def test_it_is_drawn_from_its_seed(limits: BenchLimits) -> None:
    drawn = {
        seed: [(s.temperature_c, s.rate_dps) for s in parts(make_plan(recipe(verification={"seed": seed}), limits))[1]]
        for seed in (1, 2)
    }
    again = parts(make_plan(recipe(verification={"seed": 1}), limits))[1]
    assert drawn[1] == [(s.temperature_c, s.rate_dps) for s in again]
    assert drawn[1] != drawn[2]


def test_its_positions_can_be_named(limits: BenchLimits) -> None:
    named = recipe(verification={"positions": ["-z"], "rates": 3})
    assert [s.position for s in parts(make_plan(named, limits))[1]] == ["-z"] * 3


def test_a_rate_that_the_table_cannot_run_becomes_rest(limits: BenchLimits) -> None:
    def achievable_dps(rate_dps: float) -> float:
        return round(rate_dps)

    coarse = replace(limits, achievable_dps=achievable_dps)
    slow = recipe(rates_dps=[-1.0, 0.0, 1.0], verification={"rates": 3})
    assert {s.rate_dps for s in parts(make_plan(slow, coarse))[1]} <= {0.0, 1.0, -1.0}
    assert 0.0 not in {s.rate_dps for s in parts(make_plan(slow, limits))[1]}


def test_plans_without_it_keep_their_hash(limits: BenchLimits) -> None:
    """A certificate names the hash of the plan: it stays what it was without verification, courses, ramps."""
    plan = make_plan(read_recipe("short"), limits)
    steps = [step.model_dump(exclude={"expected_s", "verification", "course", "wait"}) for step in plan.steps]
    text = json.dumps(steps, sort_keys=True, separators=(",", ":"))
    assert plan.schedule_hash == hashlib.sha256(text.encode()).hexdigest()
    with_it = make_plan(read_recipe("short").model_copy(update={"verification": recipe().verification}), limits)
    assert with_it.schedule_hash != plan.schedule_hash


def test_too_many_data_sets_are_refused_before_they_are_written_down(limits: BenchLimits) -> None:
    many = recipe(repeats=1190, verification={"temperatures": 50, "rates": 200})
    with pytest.raises(PlanRefused, match="may have at most"):
        make_plan(many, limits)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("rates = 2", "verification.rates.*greater than or equal to 3"),
        ("temperatures = 0", "verification.temperatures"),
        ("share = 0.1", "unknown key 'verification.share'"),
        ('positions = ["up"]', "verification.positions"),
    ],
)
def test_what_is_wrong_is_named(table: str, message: str) -> None:
    text = f"""name = "r"
temperatures_c = [20]
rates_dps = [0, 10]
positions = ["z"]
[verification]
{table}
"""
    with pytest.raises(RecipeError, match=message):
        parse_recipe(text)
