"""A designed recipe has the steps of the supply and the second radius that its effects need."""

from __future__ import annotations

import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.eccentricity import Eccentricity
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.errors import BadInput
from labctl.services.design.design import design_campaign
from labctl.services.planning.loading import load_bench, with_drivers
from procedures.recipe.recipe import Recipe, parse_recipe
from tests.helpers.supplied_bench import with_supply

EVEN, OF_RADIUS, OF_SUPPLY = "scale_factor_even", "centripetal_acceleration", "supply_sensitivity"


def designed(bench: BenchFile, *effects: str) -> DesignResponse:
    asked = {"like": "ojeda2000", "model": "bias_scale", "effects": effects, "hours": 40.0}
    return design_campaign(None, DesignRequest.model_validate(asked), bench)


def recipe_on(bench: BenchFile, *effects: str) -> Recipe:
    return parse_recipe(designed(bench, *effects).recipe_toml)


def test_the_steps_of_the_supply_are_in_the_recipe_and_cost_little_of_u() -> None:
    bench = with_drivers(with_supply(read_bench("single-axis-sim")))
    with_steps = designed(bench, OF_SUPPLY)
    supply = parse_recipe(with_steps.recipe_toml).supply
    assert supply is not None
    assert min(supply.deviations_pct) < 0 < max(supply.deviations_pct)
    plain = designed(bench)
    assert parse_recipe(plain.recipe_toml).supply is None
    # the effect is known from the steps, so that the bias at the nominal voltage is as well known as without it
    assert with_steps.chosen.u_worst_dps < 1.2 * plain.chosen.u_worst_dps


def test_without_a_supply_its_effect_is_refused() -> None:
    with pytest.raises(BadInput, match="bench single-axis-sim cannot change the supply voltage of the units; name"):
        designed(load_bench("single-axis-sim"), OF_SUPPLY)


def test_the_second_radius_is_in_the_recipe_of_a_model_with_both_effects() -> None:
    bench = load_bench("single-axis-sim")
    two = bench.model_copy(update={"eccentricity": Eccentricity(radius_m=0.06, other_radii_m=(0.2,))})
    other = recipe_on(two, EVEN, OF_RADIUS).another_radius
    assert other is not None
    assert max(other.rates_dps) == 100.0
    assert recipe_on(two, EVEN).another_radius is None
    one = bench.model_copy(update={"eccentricity": Eccentricity(radius_m=0.06)})
    assert recipe_on(one, EVEN, OF_RADIUS).another_radius is None
