"""What opposite mountings are worth, before the run, against the budget of a fit to the run."""

from __future__ import annotations

import math
import tomllib
from typing import Any

import pytest

from labctl.answers.calibrations import FitRequest
from labctl.calibration import read_calibration
from labctl.fitting.data.mounting_angles import ANGLE_QUANTITIES
from labctl.recording import to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.uncertainty import coefficients_at
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.planning.plan_answer import misalignment_outlook
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import open_store
from procedures.contracts.steps import Mount
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import Indexing, Inverted
from tests.helpers.certificates import AT

BENCH = load_bench("triaxial-sim")
RULES = {"temperatures_c": (30.0,), "rates_dps": (400.0, -400.0)}
INVERTED = Inverted.model_validate(RULES)
TURNED = Indexing.model_validate({**RULES, "unit_deg": (180,)})
CUBE = Indexing.model_validate({**RULES, "fixture_deg": (90, 180)})
EFFECTS = ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment"]
SIX = ("x", "-x", "y", "-y", "z", "-z")


def outlook(recipe: Recipe) -> Any:
    return misalignment_outlook(make_plan(recipe, limits_of(BENCH)), BENCH, limits_of(BENCH))


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [{}, {"inverted": INVERTED}, {"positions": SIX}, {"indexing": TURNED}, {"indexing": CUBE, "inverted": INVERTED}],
    ids=["three mountings", "inverted", "six faces", "turned on the face", "fixture turned, inverted"],
)
def test_the_budget_of_the_fit_is_what_the_plan_said(changes: dict[str, Any], tmp_path: Any) -> None:
    recipe = load_recipe("quick-triaxial").model_copy(update=changes)
    said = outlook(recipe)
    gyro = BENCH.gyros[0].model_copy(update={"sample_rate_hz": 4.0})
    recording = hidden_recording(make_plan(recipe, limits_of(BENCH)), BENCH, gyro, 3, {})
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(to_points(recording), AT)
        fit_unit(store, "STIM-0001", FitRequest(effects=EFFECTS), AT)
        calibration = read_calibration(store.calibrations.document("STIM-0001", 1)[0])
    budget = coefficients_at(calibration, 25.0)["x"]["misalignment_y"]
    of_bench = sum((line.contribution or 0.0) ** 2 for line in budget.lines if line.source in ANGLE_QUANTITIES)
    placed = next((line.contribution or 0.0) for line in budget.lines if line.source == "coefficients")
    # how a unit is placed in each of several mountings is in the coefficients, with the noise
    of_mountings = math.hypot(of_bench**0.5, placed if changes else 0.0)
    assert 2.0 * of_mountings == pytest.approx(said.expanded, rel=0.1 if changes else 2e-3)
    assert said.not_stated == []


@pytest.mark.parametrize(
    ("changes", "number"), [*(({}, k) for k in range(4)), *(({"indexing": CUBE}, k) for k in (0, 1))]
)
def test_further_mountings_are_worth_and_cost_what_is_said(changes: dict[str, Any], number: int) -> None:
    recipe = load_recipe("quick-triaxial").model_copy(update=changes)
    more = outlook(recipe).further[number]
    added = tomllib.loads(more.recipe_toml)
    kinds = {"indexing": Indexing, "inverted": Inverted}
    longer = recipe.model_copy(update={name: kinds[name].model_validate(table) for name, table in added.items()})
    plans = [make_plan(each, limits_of(BENCH)) for each in (recipe, longer)]
    assert plans[1].expected_s - plans[0].expected_s == pytest.approx(more.more_s)
    assert outlook(longer).expanded == pytest.approx(more.expanded)
    mounted = [sum(isinstance(step, Mount) for step in plan.steps) for plan in plans]
    assert mounted[1] - mounted[0] == more.mountings == 3
    assert more.turned not in {offered.turned for offered in outlook(longer).further}


def test_a_recipe_that_turns_something_keeps_that_and_is_offered_what_it_does_not_turn_yet() -> None:
    (best, *_) = outlook(load_recipe("quick-triaxial").model_copy(update={"indexing": CUBE})).further
    assert best.turned == "each unit turned by 180 deg on its face"
    assert Indexing.model_validate(tomllib.loads(best.recipe_toml)["indexing"]) == CUBE.model_copy(
        update={"unit_deg": (180,)}
    )


def test_a_unit_turned_on_its_face_leaves_how_well_it_is_placed_again() -> None:
    said = outlook(load_recipe("quick-triaxial"))
    best = said.further[0]
    assert best.turned == "each unit turned by 180 deg on its face"
    (placed,) = (each for each in BENCH.standards if each.quantity == "mounting_repeatability")
    assert best.expanded == pytest.approx(2.0 * math.radians(placed.standard_u) / 2**0.5)
    assert [each.expanded for each in said.further] == sorted(each.expanded for each in said.further)


def test_what_the_bench_does_not_state_is_said() -> None:
    bare = BENCH.model_copy(
        update={"standards": tuple(each for each in BENCH.standards if each.quantity == "fixture_angle")}
    )
    said = misalignment_outlook(make_plan(load_recipe("quick-triaxial"), limits_of(bare)), bare, limits_of(bare))
    assert said is not None
    assert said.not_stated == ["tilt", "mounting_repeatability"]
    assert said.further[0].expanded == pytest.approx(0.0, abs=1e-12)  # by fixture and table, as far as they are stated


def test_where_no_output_lies_across_nothing_is_said() -> None:
    bench = load_bench("single-axis-sim")
    assert misalignment_outlook(make_plan(load_recipe("short"), limits_of(bench)), bench, limits_of(bench)) is None


def test_where_the_bench_states_nothing_nothing_is_known() -> None:
    bare = BENCH.model_copy(update={"standards": ()})
    plan = make_plan(load_recipe("quick-triaxial"), limits_of(bare))
    assert misalignment_outlook(plan, bare, limits_of(bare)) is None
