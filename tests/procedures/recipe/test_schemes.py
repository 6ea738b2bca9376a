"""Schemes of a calibration: the recipes that they make."""

from __future__ import annotations

import numpy as np
import pytest

from procedures.recipe.fit_rules import FitRules
from procedures.recipe.recipe import Recipe, read_recipe
from procedures.recipe.schemes import (
    NO_SOAK,
    Cycle,
    Levels,
    Scheme,
    Soak,
    Span,
    alternating,
    recipe_of,
    spread_rates_dps,
    spread_temperatures_c,
)

BASE, SPAN = read_recipe("informative"), Span(400.0, -40.0, 50.0)
SOAK = Soak(600.0, 300.0, 1.5)


def made(scheme: Scheme, base: Recipe = BASE, span: Span = SPAN) -> Recipe:
    return recipe_of(scheme, base, span, name="made", fit=FitRules(model="bias_scale"), ramp_c_per_min=2.0)


def test_levels_have_the_ends_of_the_range_and_every_rate_in_both_directions() -> None:
    recipe = made(Levels(4, SOAK, 5, 30.0, "up_down"))
    assert recipe.temperatures_c == (-40.0, -17.5, 27.5, 50.0)
    assert recipe.rates_dps == (-400.0, -282.8, 0.0, 282.8, 400.0)
    assert (recipe.rate_order, recipe.temperature_order) == ("random", "up_down")
    assert (recipe.soak.hold_s, recipe.soak.drift_window_s, recipe.soak.max_drift_c) == (600.0, 300.0, 1.5)
    assert recipe.acquire.duration_s == 30.0
    assert recipe.acquire.settle_s == BASE.acquire.settle_s


def test_a_cycle_begins_and_ends_where_units_are_mounted_and_sees_both_ends() -> None:
    ramp = made(Cycle(7, 30.0, 120.0, 600.0)).ramp
    assert ramp is not None
    assert (ramp.from_c, *ramp.ends_c) == (25.0, -40.0, 50.0, 25.0)
    assert (ramp.dwell_s, ramp.first_dwell_s, ramp.c_per_min) == (120.0, 720.0, None)
    assert ramp.way_c == 180.0
    twice = made(Cycle(7, 30.0, 0.0, 0.0, ramp_share=0.5, cycles=2)).ramp
    assert twice is not None
    assert twice.ends_c == (-40.0, 50.0, -40.0, 50.0, 25.0)
    assert (twice.c_per_min, twice.first_dwell_s) == (1.0, None)


def test_a_cycle_of_a_range_beside_the_handling_temperature_begins_at_its_next_end() -> None:
    ramp = made(Cycle(7, 30.0, 0.0, 0.0), span=Span(100.0, 30.0, 60.0)).ramp
    assert ramp is not None
    assert (ramp.from_c, *ramp.ends_c) == (30.0, 60.0, 30.0)


def test_what_belongs_to_another_recipe_alone_is_not_taken_over() -> None:
    recipe = made(Levels(4, NO_SOAK, 5, 30.0))
    assert (recipe.inverted, recipe.power_cycle, recipe.ramp) == (None, None, None)
    assert recipe.replicates.repeated_rates == 0
    assert recipe.mounting == BASE.mounting
    assert recipe.positions == BASE.positions


@pytest.mark.parametrize("number", [5, 6, 7, 11])
def test_rates_have_both_signs_once_and_the_largest(number: int) -> None:
    rates = spread_rates_dps(SPAN, number)
    assert len(set(rates)) == number
    assert sorted(rates) == sorted(-rate for rate in rates)
    assert max(rates) == 400.0
    in_turn = alternating(rates)
    assert sorted(in_turn) == sorted(rates)
    assert [np.sign(rate) for rate in in_turn[:4]] == [1, -1, 1, -1]
    assert np.sum(in_turn[:2]) == 0


def test_temperatures_are_denser_towards_the_ends() -> None:
    steps = np.diff(spread_temperatures_c(SPAN, 7))
    assert list(steps) == pytest.approx(list(steps[::-1]), abs=0.11)
    assert steps[0] < steps[1] < steps[2]
