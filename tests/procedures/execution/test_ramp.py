"""Data sets while the temperature moves: the plan of a [ramp], its limits, its run, and where it is resumed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import PlanRefused, RecipeError
from procedures.contracts.steps import Acquire, MoveChamber, Soak
from procedures.monitoring.guards import Guards
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan
from procedures.recipe.recipe import parse_recipe
from procedures.recipe.rules import GuardRules
from tests.helpers.guard_trips import WELL

FAST: dict[str, Any] = {"from_c": 30.0, "to_c": 40.0, "rates_dps": [0.0, 20.0], "back": True}


def of_ramp(plan: Plan) -> list[Any]:
    """Return the steps from the first move that is not waited for."""
    first = next(n for n, step in enumerate(plan.steps) if isinstance(step, MoveChamber) and not step.wait)
    return [step for step in plan.steps[first:] if isinstance(step, MoveChamber | Acquire | Soak)]


def planned(rig: Any, **changes: Any) -> Plan:
    return rig.plan(rig.recipe(positions=["z"], ramp=FAST | changes))


def test_as_fast_as_the_chamber_can_it_is_set_once_for_each_leg(rig: Any) -> None:
    steps = of_ramp(planned(rig))
    assert [(step.temperature_c, step.wait) for step in steps if isinstance(step, MoveChamber)][:2] == [
        (40.0, False),
        (30.0, False),
    ]
    sets = [step for step in steps if isinstance(step, Acquire)]
    assert [step.rate_dps for step in sets[:4]] == [0.0, 20.0, 0.0, 20.0]
    ramp_s = 60 * 10.0 / rig.limits.ramp_c_per_min
    assert sum(step.expected_s for step in sets) >= 2 * ramp_s
    assert len({step.dataset for step in sets}) == len(sets)


def test_slower_it_goes_in_a_step_before_each_data_set(rig: Any) -> None:
    steps = of_ramp(planned(rig, c_per_min=0.5, back=False))
    moves = [step.temperature_c for step in steps if isinstance(step, MoveChamber)]
    sets = [step for step in steps if isinstance(step, Acquire)]
    assert moves == sorted(moves)
    assert moves[-1] == 40.0
    assert len(moves) == len(sets)
    assert sum(step.expected_s for step in sets) == pytest.approx(60 * 10.0 / 0.5, rel=0.05)


def test_a_cycle_goes_on_to_further_ends_and_stays_between_two_legs(rig: Any) -> None:
    whole = {"back": False, "then_c": [20.0, 30.0]}
    ends = [30.0, 40.0, 20.0, 30.0]
    legs = of_legs(planned(rig, **whole))
    assert [temperature_c for temperature_c, _ in legs] == ends[1:]
    ramp_c_per_min = rig.limits.ramp_c_per_min
    for (_, lasts_s), way_c in zip(legs, np.abs(np.diff(ends)), strict=True):
        assert lasts_s >= 60 * way_c / ramp_c_per_min
    staying = of_legs(planned(rig, **whole, dwell_s=600.0))
    more = [long - short for (_, long), (_, short) in zip(staying, legs, strict=True)]
    assert more == pytest.approx([600.0, 600.0, 0.0], abs=set_s(rig))


def test_the_first_mounting_may_stay_longer(rig: Any) -> None:
    recipe = rig.recipe(positions=["z", "-z"], ramp=FAST | {"first_dwell_s": 900.0})
    legs = of_legs(rig.plan(recipe))
    assert legs[0][1] - legs[2][1] == pytest.approx(900.0, abs=set_s(rig))
    assert legs[1][1] == pytest.approx(legs[3][1])


def of_legs(plan: Plan) -> list[tuple[float, float]]:
    """Return where each leg ends and how long its data sets take, s."""
    legs: list[tuple[float, float]] = []
    moving = False
    for step in plan.steps:
        if isinstance(step, MoveChamber):
            moving = not step.wait
            legs += [(step.temperature_c, 0.0)] if moving else []
        elif moving and isinstance(step, Acquire):
            legs[-1] = legs[-1][0], legs[-1][1] + step.expected_s
    return legs


def set_s(rig: Any) -> float:
    """Return how long the longest data set takes, s."""
    return max(step.expected_s for step in planned(rig).steps if isinstance(step, Acquire))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"then_c": [30.0, 200.0], "back": False}, "ramp.then_c 200"),
        ({"to_c": 200.0}, "ramp.to_c 200"),
        ({"from_c": -90.0}, "ramp.from_c -90"),
        ({"c_per_min": 500.0}, "ramp.c_per_min 500: faster than"),
        ({"rates_dps": [0.0, 1e5]}, "ramp.rates_dps 100000"),
    ],
)
def test_what_the_bench_cannot_do_is_refused(rig: Any, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanRefused, match=said):
        planned(rig, **changes)


def test_a_ramp_that_goes_nowhere_is_refused() -> None:
    text = 'name = "r"\ntemperatures_c = [20]\nrates_dps = [0]\npositions = ["z"]\n[ramp]\nfrom_c = 20\nto_c = 20\n'
    with pytest.raises(RecipeError, match="the same, so that nothing moves"):
        parse_recipe(f"{text}rates_dps = [0]\n")


def test_a_leg_that_goes_nowhere_is_refused(rig: Any) -> None:
    with pytest.raises(ValueError, match="then_c: a leg begins and ends at the same temperature"):
        rig.recipe(positions=["z"], ramp=FAST | {"then_c": [30.0]})


def test_a_campaign_with_a_ramp_runs_through_and_reads_while_the_air_moves(rig: Any) -> None:
    recipe = rig.recipe(positions=["z"], ramp=FAST, guards={"chamber_deviation_c": 1.0})
    outcome = rig.run(recipe)
    assert (outcome.state, outcome.safe) == (CampaignState.DONE, True), outcome
    assert [result.outcome for result in rig.journal.results()] == ["done"] * len(rig.engine.plan.steps)
    numbers = [step.dataset for step in of_ramp(rig.engine.plan) if isinstance(step, Acquire)]
    assert set(numbers) <= {dataset for dataset, *_ in rig.journal.blocks}


def test_air_off_its_set_point_trips_unless_it_is_meant_to_move(limits: BenchLimits) -> None:
    guards = Guards(GuardRules(), limits)
    off = replace(WELL, chamber_c=30.0, taking_readings=True)
    assert {"chamber_deviation"} <= {trip.kind for trip in guards.check(off)}
    assert guards.check(replace(off, air_moves=True)) == []
    too_hot = replace(off, air_moves=True, chamber_c=160.0)
    assert {trip.kind for trip in guards.check(too_hot)} == {"chamber_limits", "unit_air"}


def test_a_ramp_is_resumed_from_where_it_began(rig: Any) -> None:
    plan = planned(rig)
    moving = next(n for n, step in enumerate(plan.steps) if isinstance(step, MoveChamber) and not step.wait)
    lead = plan.lead_in(moving + 2)
    assert [(step.kind, getattr(step, "temperature_c", None)) for step in lead] == [
        ("home", None),
        ("move_chamber", 30.0),
        ("move_chamber", 40.0),
    ]
    assert [step.kind for step in plan.lead_in(moving)] == ["home", "move_chamber"]


def test_the_hash_of_a_plan_without_a_ramp_is_that_of_earlier_versions(rig: Any) -> None:
    plan = rig.plan()
    moves = tuple(step for step in plan.steps if isinstance(step, MoveChamber))
    of_old = [{n: getattr(step, n) for n in ("kind", "temperature_c", "band_c", "timeout_s")} for step in moves]
    text = json.dumps(of_old, sort_keys=True, separators=(",", ":"))
    assert Plan(recipe=plan.recipe, steps=moves).schedule_hash == hashlib.sha256(text.encode()).hexdigest()
    waits = Plan(recipe=plan.recipe, steps=tuple(step.model_copy(update={"wait": False}) for step in moves))
    assert waits.schedule_hash != Plan(recipe=plan.recipe, steps=moves).schedule_hash
