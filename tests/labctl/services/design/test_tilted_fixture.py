"""A design with a tilted fixture: what it saves, that its recipe runs, and that its fit finds the unit."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from instruments.standards import Standard
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import preset_for
from labctl.fitting.uncertainty.sensitivity import coefficients_of
from labctl.services.design.design import design_campaign
from labctl.services.planning.loading import limits_of, load_bench
from labctl.services.simulation.plan_simulation import simulate
from procedures.contracts.steps import Mount
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import parse_recipe

BENCH = load_bench("triaxial-sim")
#: The direction of a tilted fixture is off by half a degree in this simulation.
TILTED = BENCH.model_copy(
    update={
        "tilted_positions": ("x+y+z",),
        "standards": (*BENCH.standards, Standard(quantity="tilted_fixture_angle", u=0.5)),
        "simulation": SimulationSettings(seed=4, draw_standards=True),
        "gyros": (BENCH.gyros[0].model_copy(update={"sample_rate_hz": 4.0}),),
    }
)


def designed(bench: BenchFile, **asked: Any) -> DesignResponse:
    request = {"like": "table1-x-table2", "model": "bias_scale", "u_dps": 0.004, **asked}
    return design_campaign(None, DesignRequest.model_validate(request), bench)


@cache
def with_fixture() -> DesignResponse:
    return designed(TILTED)


@cache
def without_fixture() -> DesignResponse:
    return designed(BENCH)


@pytest.mark.slow
def test_it_says_what_a_tilted_fixture_saves_and_chooses_it_where_the_bench_has_one() -> None:
    has, has_not = with_fixture(), without_fixture()
    assert has.tilted is not None
    assert has_not.tilted is not None
    assert (has.tilted.is_on_bench, has_not.tilted.is_on_bench) == (True, False)
    assert has.chosen == has.tilted.best == has_not.tilted.best
    assert has.is_reached
    assert has_not.chosen == has.tilted.without
    assert has.chosen.hours < 0.6 * has_not.chosen.hours
    assert has.chosen.mountings == has_not.chosen.mountings + 1
    assert has.bound is not None
    assert has_not.bound is not None
    assert has.bound == has.tilted.bound == has_not.tilted.bound
    assert has.bound.heat_h == pytest.approx(has_not.bound.heat_h / 3.0)  # one course of the temperature for three
    assert has.chosen.hours > has.bound.bound_h
    assert any("The temperature moves with x+y+z up alone" in each for each in has.decisions)
    with pytest.raises(Exception, match="states no tilted fixture"):
        make_plan(parse_recipe(has.recipe_toml), limits_of(BENCH))


@pytest.mark.slow
def test_its_recipe_runs_and_its_fit_finds_the_unit_whatever_the_fixture_is_off_by() -> None:
    recipe = parse_recipe(with_fixture().recipe_toml)
    plan = make_plan(recipe, limits_of(TILTED, driven=True))
    assert [step.position for step in plan.steps if isinstance(step, Mount)] == ["x", "y", "z", "x+y+z"]
    assert recipe.fit is not None
    (gyro,) = TILTED.gyros
    data = fit_data_of(simulate(plan, TILTED, gyro))
    result = fit_preset(data, preset_for(recipe.fit.model, list(recipe.fit.effects)))
    tilts = [angles["x+y+z tilt"] for angles in result.angles_rad.values()]
    assert np.linalg.norm(tilts) > np.radians(0.1)
    truth = open_simulation(TILTED, VirtualClock()).world.gyro(gyro.name).truth
    for warm in (-35.0, 0.0, 45.0):
        scale = np.diag(truth.gain(np.array([warm]))[0]) - 1.0
        found = [coefficients_of(axis)["scale_factor"][1].value(result.fitted, warm) for axis in "xyz"]
        np.testing.assert_allclose(found, scale, atol=4e-5)


@pytest.mark.slow
def test_a_fixture_is_of_no_use_to_one_axis_or_a_table_over_temperature() -> None:
    single = design_campaign(
        None, DesignRequest(like="ojeda2000", model="bias_scale", hours=3.0), load_bench("single-axis-sim")
    )
    assert single.tilted is None
    assert designed(TILTED, model="yang2018", u_dps=0.01).tilted is None


@pytest.mark.slow
def test_hours_are_shared_by_the_units_that_fit_on_the_table() -> None:
    assert BENCH.table is not None
    three = BENCH.model_copy(update={"table": BENCH.table.model_copy(update={"places": 3})})
    alone, shared = without_fixture(), designed(three)
    assert (alone.units_at_once, shared.units_at_once) == (1, 3)
    assert alone.chosen.hours == shared.chosen.hours == alone.chosen.hours_per_unit
    assert shared.chosen.hours_per_unit == pytest.approx(shared.chosen.hours / 3)
    assert "3 units at once (table.places of the bench file)" in " ".join(shared.assumptions)
    assert "1 unit at once (those in the bench file" in " ".join(alone.assumptions)
