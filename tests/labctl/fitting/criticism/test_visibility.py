"""Which effects a schedule can show: not one that would have to be larger than it can be."""

from __future__ import annotations

import math

import pytest

from labctl.fitting.criticism import effect_visibilities, visibility
from labctl.fitting.criticism.ranking import FARTHEST, largest_physical
from labctl.fitting.effects import CATALOGUE
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.visibility import planned_schedule
from procedures.planning.plan import make_plan


@pytest.mark.parametrize(
    ("effect", "unit", "technology", "largest"),
    [
        ("dead_band", "1", "mems", 1.0),  # a part of a whole: 100 %
        ("missed_steps", "1", "fog", 1.0),
        ("misalignment", "1", "mems", FARTHEST * 0.02),
        ("bias", "deg/s", "mems", FARTHEST * 3.0),
        ("sine_response", "(rad/(rad/s))^2", "mems", 0.0),  # of interferometers only
        ("rate_temperature_surface", "deg/s", "mems", math.inf),  # no range is known
    ],
)
def test_no_effect_is_larger_than_it_can_be(effect: str, unit: str, technology: str, largest: float) -> None:
    assert largest_physical(effect, unit, technology) == pytest.approx(largest)


def test_an_effect_that_the_technology_does_not_have_needs_no_experiment() -> None:
    bench = load_bench("triaxial-sim")  # of MEMS gyros
    schedule = planned_schedule(make_plan(load_recipe("short"), limits_of(bench)), bench)
    found = {each.effect: each for each in effect_visibilities(schedule)}
    sine = found["sine_response"]  # of interferometers
    assert (sine.visible, sine.why, sine.experiment, sine.smallest_size) == (False, "technology", "", None)
    assert [each.effect for each in found.values() if each.why == "technology"] == ["sine_response"]


def test_a_size_beyond_what_is_physical_is_not_detectable() -> None:
    bench = load_bench("single-axis-sim")
    schedule = planned_schedule(make_plan(load_recipe("short"), limits_of(bench)), bench)
    found = {each.effect: each for each in effect_visibilities(schedule)}
    hidden = found["dead_band"]  # the slowest rate of the recipe is far above any dead band
    assert (hidden.visible, hidden.why, hidden.unit) == (False, "size", "1")
    assert hidden.smallest_size is not None
    assert hidden.smallest_size > 1.0  # more than the whole band
    assert hidden.share > visibility.MIN_VISIBLE  # the schedule alone would not hide it
    assert hidden.experiment
    assert found["scale_factor_asymmetry"].visible


def test_every_effect_counts_but_the_surface_which_is_a_form_of_a_model() -> None:
    bench = load_bench("single-axis-sim")
    schedule = planned_schedule(make_plan(load_recipe("short"), limits_of(bench)), bench)
    found = [each.effect for each in effect_visibilities(schedule)]
    assert len(found) == len(set(found))
    assert set(CATALOGUE) - set(found) == {"rate_temperature_surface"}


def test_a_term_beyond_those_of_the_model_says_its_order() -> None:
    """The surface of a first fit absorbs the square of the rate: what can be detected is its fourth power."""
    bench = load_bench("single-axis-sim")
    schedule = planned_schedule(make_plan(load_recipe("short"), limits_of(bench)), bench)
    found = {each.effect: each for each in effect_visibilities(schedule)}
    even = found["scale_factor_even"]
    assert (even.visible, even.in_model, even.order, even.unit) == (True, True, 4, "(deg/s)^-3")
    assert found["scale_factor_asymmetry"].order is None
    assert found["bias"].in_model
    unexcited = found["time_delay"]  # nothing changes within a data set
    assert (unexcited.visible, unexcited.in_model, unexcited.share) == (False, False, 0.0)


def test_one_temperature_on_several_axes_has_a_first_model_too() -> None:
    bench = load_bench("triaxial-sim")
    recipe = load_recipe("short").model_copy(update={"temperatures_c": (25.0,), "positions": ("x", "y", "z")})
    schedule = planned_schedule(make_plan(recipe, limits_of(bench)), bench)
    assert {"bias", "scale_factor", "misalignment"} <= schedule.in_model
    found = {each.effect: each for each in effect_visibilities(schedule)}
    assert found["scale_factor_asymmetry"].visible
