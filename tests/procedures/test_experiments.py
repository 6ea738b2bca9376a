"""The building blocks of experiments: each makes a recipe that runs, and others can add their own."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from instruments import plugins
from instruments.eccentricity import Eccentricity
from instruments.interfaces.supply import SupplyLimits
from instruments.plugins import PluginError, PluginGroup
from instruments.simulators.physics.motion import TableMotion
from labctl.services.criticism.next_experiment import plans_of
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from procedures import experiments
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, MoveChamber
from procedures.experiments import BLOCKS, NOT_TAKEN, Block, _checked, all_blocks
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe, parse_recipe, recipe_document
from tests.helpers.distributions import distribution
from tests.helpers.paths import ROOT


def test_labctls_own_blocks_are_found_by_their_entry_point() -> None:
    assert all_blocks()[: len(BLOCKS)] == BLOCKS
    assert len({block.id for block in BLOCKS}) == len(BLOCKS)


@pytest.mark.parametrize(
    ("recipe", "bench"), [("ojeda2000", "single-axis-sim"), ("table1-x-table2", "triaxial-sim"), ("informative", None)]
)
def test_each_block_makes_a_plan_within_the_limits_that_differs_from_the_recipe(recipe: str, bench: str | None) -> None:
    whole = load_recipe(recipe)
    supply = SupplyLimits(nominal_v=5.0, min_v=4.5, max_v=5.5, current_limit_a=1.0, tolerance_v=0.05)
    where = Eccentricity(radius_m=0.06, other_radii_m=(0.2,))
    limits = limits_of(load_bench(bench or "triaxial-sim"))
    limits = replace(limits, tilted_positions=("x+y+z",), supply=supply, eccentricity=where)
    made = {block.id: block.changed(whole) for block in BLOCKS}
    assert sum(changed is None for changed in made.values()) <= 3
    for name, changed in made.items():
        if changed is None:
            continue
        plan = make_plan(changed, limits, clip=True)
        assert plan.datasets > 0, name
        assert changed != whole, name
        assert changed.fit is None, name
        assert Recipe.model_validate(recipe_document(changed)) == changed, name


def test_a_tilted_unit_is_asked_for_where_the_bench_has_the_fixture_and_the_unit_three_axes() -> None:
    block = next(block for block in BLOCKS if block.id == "tilted")
    assert block.changed(load_recipe("ojeda2000")) is None
    changed = block.changed(load_recipe("quick-triaxial"))
    assert changed is not None
    assert changed.positions == ("x", "y", "z", "x+y+z")
    bench = load_bench("triaxial-sim")
    with pytest.raises(PlanRefused, match="states no tilted fixture"):
        make_plan(changed, limits_of(bench))
    fixture = bench.model_copy(update={"tilted_positions": ("x+y+z",)})
    offered = [{each.block.id for each in plans_of(load_recipe("quick-triaxial"), on)} for on in (bench, fixture)]
    assert offered[1] - offered[0] == {"tilted"}


def test_a_recipe_at_rest_is_not_turned_and_one_of_turns_by_hand_not_changed() -> None:
    night, by_hand = load_recipe("static-night"), load_recipe("by-hand")
    at_rest = {block.id: changed for block in BLOCKS if (changed := block.changed(night)) is not None}
    assert "top_rates" not in at_rest
    assert not any(any(changed.rates_dps) for changed in at_rest.values())
    assert all(block.changed(by_hand) is None for block in BLOCKS)


def test_ramps_take_their_data_sets_while_the_chamber_moves(limits: BenchLimits) -> None:
    slow = next(block for block in BLOCKS if block.id == "slow_ramp").changed(load_recipe("quick-triaxial"))
    assert slow is not None
    steps = make_plan(slow, limits).steps
    moving = [n for n, step in enumerate(steps) if isinstance(step, MoveChamber) and not step.wait]
    assert len(moving) > 50
    assert all(isinstance(steps[n + 1], Acquire) for n in moving)


def test_what_a_recipe_measures_beside_its_points_is_not_taken_over() -> None:
    recipe = parse_recipe(
        'name = "r"\ntemperatures_c = [20, 30, 40]\nrates_dps = [0, 10]\npositions = ["z"]\nrepeats = 5\n'
        "[verification]\n[power_cycle]\nrates_dps = [0]\n"
    )
    few = next(block for block in BLOCKS if block.id == "top_rates").changed(recipe)
    assert few is not None
    assert (few.verification, few.power_cycle, few.repeats) == (None, None, NOT_TAKEN["repeats"])


def test_what_is_no_block_is_refused() -> None:
    own = Block("mine", "something else", lambda recipe: {"repeats": 2})
    assert _checked(own) == (own,)
    with pytest.raises((TypeError, PluginError), match="is not a Block"):
        _checked([own, "mine"])


def test_near_rest_a_stepper_turns_by_whole_cycles_of_its_motor() -> None:
    """A part of a cycle, and one step more or less, would look like a dead band."""
    near_rest = next(block for block in BLOCKS if block.id == "near_rest")
    for name in ("ojeda2000", "ojeda2000-121", "table1-x-table2", "quick-triaxial", "informative"):
        whole = load_recipe(name)
        changed = near_rest.changed(whole)
        assert changed is not None
        cycles = [abs(rate) * changed.acquire.duration_s / 1.8 for rate in changed.rates_dps if rate]
        assert cycles == pytest.approx([round(each) for each in cycles], abs=1e-3), name
        assert min(cycles) >= 1.0
        assert changed.acquire.duration_s <= 600.0
        assert max(changed.rates_dps) == pytest.approx(max(whole.rates_dps), rel=1e-3)


def test_between_the_rates_a_table_turns_by_whole_turns_and_its_mean_rate_is_the_commanded_one() -> None:
    """Over a part of a cycle of its motor the angle of a stepper is wrong by more than a good gyro's noise."""
    whole = load_recipe("ojeda2000-121")
    changed = next(block for block in BLOCKS if block.id == "between_rates").changed(whole)
    assert changed is not None
    wrong_dps: dict[float, list[float]] = {}
    for duration_s in (whole.acquire.duration_s, changed.acquire.duration_s):
        for rate in changed.rates_dps:
            motion, step_hz = TableMotion(1600), abs(rate) / 0.225
            motion.start(0.0, int(np.sign(rate)) * 200_000, step_hz, 90.0)
            begin, end = motion.angle_deg(np.array([10.0, 10.0 + duration_s]))
            wrong_dps.setdefault(duration_s, []).append(abs((end - begin) / duration_s - rate))
    assert list(wrong_dps) == [30.0, 36.0]
    assert max(wrong_dps[30.0]) > 5e-4
    assert max(wrong_dps[36.0]) < 1e-9


def test_between_the_temperatures_a_few_rates_are_measured_and_no_effects_are_distinguished_by_that() -> None:
    block = next(block for block in BLOCKS if block.id == "between_temperatures")
    whole = load_recipe("ojeda2000-121")
    changed = block.changed(whole)
    assert changed is not None
    rising = sorted(whole.temperatures_c)
    assert changed.temperatures_c == pytest.approx([(low + high) / 2 for low, high in pairwise(rising)])
    assert changed.rates_dps == pytest.approx([-100.0, -60.0, 0.0, 60.0, 100.0])
    assert block.changed(whole.model_copy(update={"temperatures_c": (20.0, 25.0, 30.0, 35.0)})) is None
    assert block.id not in {each.block.id for each in plans_of(whole, load_bench("single-axis-sim"))}


def test_sines_are_swept_where_the_recipe_and_the_table_change_the_rate() -> None:
    sine = next(block for block in BLOCKS if block.id == "sine")
    assert sine.changed(load_recipe("ojeda2000-121")) is None
    recipe, servo = load_recipe("servo-sweeps"), load_bench("servo-sim")
    planned = [each for each in plans_of(recipe, servo) if each.block.id == "sine"]
    limit_dps2 = limits_of(servo).max_acceleration_dps2
    assert planned
    for each in planned:
        courses = [profile.course for profile in each.plan.recipe.profiles]
        assert {course.kind for course in courses} == {"sine_sweep"}
        assert max(course.largest_dps2 for course in courses) <= limit_dps2
        assert len(courses) == 3
    assert "sine" not in {each.block.id for each in plans_of(recipe, load_bench("single-axis-sim"))}


def test_a_block_of_another_package_is_planned_on_the_bench_as_the_page_on_extending_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = (ROOT / "docs/how-to/extending.md").read_text(encoding="utf-8")
    code = page.split("## An experiment")[1].split("```python\n")[1].split("```")[0]
    distribution(tmp_path, "acme-bench", "[labctl.experiments]\nacme = acme_bench:BLOCK\n", code)
    monkeypatch.syspath_prepend(str(tmp_path))
    plugins.installed.cache_clear()
    monkeypatch.setattr(experiments, "GROUP", PluginGroup("labctl.experiments", "experiment", _checked))
    try:
        recipe, bench = load_recipe("quick-triaxial"), load_bench("triaxial-sim")
        planned = [each for each in plans_of(recipe, bench) if each.block.id == "acme_slow_rise"]
        assert planned
        moves = [step for step in planned[0].plan.steps if isinstance(step, MoveChamber) and not step.wait]
        assert moves[-1].temperature_c == max(recipe.temperatures_c)
        assert [each.id for each in all_blocks()] == [*(block.id for block in BLOCKS), "acme_slow_rise"]
    finally:
        plugins.installed.cache_clear()
        sys.modules.pop("acme_bench", None)
