"""The limits of a bench: what is allowed at a limit and beyond it, and how the words name the limit."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.errors import LimitError
from instruments.interfaces.gyro import GyroLimits
from instruments.interfaces.rate_course import Ramp, SineSweep
from instruments.interfaces.table import TableLimits
from procedures.contracts.errors import PlanRefused
from procedures.planning.limits import ADVICE, CONSTANT_ONLY, NEEDS, BenchLimits, fit_to_bench, missing_instruments
from procedures.recipe.recipe import Recipe, read_recipe
from tests.helpers.fake_instruments import CHAMBER, TABLE

POINTS = {"temperatures_c": [20.0], "rates_dps": [10.0]}


def recipe(**changes: Any) -> Recipe:
    return Recipe.model_validate({"name": "points", "positions": ["z"]} | POINTS | changes)


def with_courses(limits: BenchLimits, **changes: Any) -> BenchLimits:
    return replace(limits, table=replace(TABLE, follows_courses=True, **changes))


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_rate_is_allowed_up_to_the_limit_of_unit_and_table(limits: BenchLimits, sign: int) -> None:
    assert limits.rate_complaint(sign * 400.0, 0.01) is None
    assert limits.rate_complaint(sign * 400.01, 0.01) == "beyond the 400 deg/s of unit imu"
    assert limits.rate_complaint(sign * 450.0, 0.01) == "beyond the 400 deg/s of unit imu"
    both = "beyond the 450 deg/s of the table and the 400 deg/s of unit imu"
    assert limits.rate_complaint(sign * 450.01, 0.01) == both


def test_without_a_table_only_the_units_limit_a_rate(limits: BenchLimits) -> None:
    assert replace(limits, table=None).rate_complaint(500.0, 0.01) == "beyond the 400 deg/s of unit imu"


@pytest.mark.parametrize(
    ("temperature_c", "complaint"),
    [
        (-40.0, None),
        (-40.01, "outside the -40 to 85 deg C of unit imu"),
        (85.0, None),
        (85.01, "outside the -40 to 85 deg C of unit imu"),
        (150.01, "outside the -70 to 150 deg C of the chamber and the -40 to 85 deg C of unit imu"),
        (-70.01, "outside the -70 to 150 deg C of the chamber and the -40 to 85 deg C of unit imu"),
    ],
)
def test_a_temperature_is_allowed_up_to_the_limits_of_unit_and_chamber(
    limits: BenchLimits, temperature_c: float, complaint: str | None
) -> None:
    assert limits.temperature_complaint(temperature_c) == complaint


@pytest.mark.parametrize(
    ("temperature_c", "is_allowed"), [(-70.0, True), (-70.01, False), (150.0, True), (150.01, False)]
)
def test_the_chamber_alone_limits_a_temperature_too(
    limits: BenchLimits, temperature_c: float, is_allowed: bool
) -> None:
    assert (replace(limits, gyros={}).temperature_complaint(temperature_c) is None) == is_allowed
    assert replace(limits, gyros={}, chamber=None).temperature_complaint(temperature_c) is None


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(("real_dps", "is_allowed"), [(10.5, True), (9.5, True), (10.51, False), (9.49, False)])
def test_the_step_clock_may_miss_a_rate_by_the_fraction_of_the_recipe(
    limits: BenchLimits, sign: int, real_dps: float, is_allowed: bool
) -> None:
    stepped = replace(limits, achievable_dps=lambda rate_dps: math.copysign(real_dps, rate_dps))
    complaint = stepped.rate_complaint(sign * 10.0, 0.05)
    said = f"the nearest rate that the table can run is {sign * real_dps:g} deg/s, more than 5 % off"
    assert complaint == (None if is_allowed else said)


def test_the_real_rate_is_that_of_the_step_clock_and_rest_is_rest(limits: BenchLimits) -> None:
    def achievable(rate_dps: float) -> float:
        if rate_dps == 0:
            raise LimitError("table", "0 deg/s is no rate of a step clock")
        return rate_dps + 0.25

    stepped = replace(limits, achievable_dps=achievable)
    assert (stepped.real_rate_dps(10.0), stepped.real_rate_dps(0.0), stepped.real_rate_dps(1.0)) == (10.25, 0.0, 1.25)
    assert stepped.rate_complaint(0.0, 0.01) is None
    assert limits.real_rate_dps(10.0) == 10.0
    assert limits.rate_complaint(10.0, 0.01) is None


def test_a_step_clock_that_refuses_a_rate_says_why(limits: BenchLimits) -> None:
    def refuse(_rate_dps: float) -> float:
        raise LimitError("table", "too slow for the step clock; request 0.05 deg/s or more")

    complaint = replace(limits, achievable_dps=refuse).rate_complaint(1.0, 0.01)
    assert complaint is not None
    assert "too slow for the step clock" in complaint


def test_ramp_and_acceleration_are_those_of_the_bench_and_infinite_without(limits: BenchLimits) -> None:
    assert (limits.max_acceleration_dps2, limits.ramp_c_per_min) == (200, 10)
    bare = BenchLimits(None, None, {})
    assert (bare.max_acceleration_dps2, bare.ramp_c_per_min) == (math.inf, math.inf)
    assert (bare.needs_person, bare.is_driven) == (True, True)  # the longer time, and the fewer courses


def test_the_limits_of_an_open_bench(rig: Any) -> None:
    found = BenchLimits.of(rig, needs_person=False, air_tau_s=120.0)
    assert (found.table, found.chamber, dict(found.gyros)) == (TABLE, CHAMBER, {"imu": rig.imu.limits})
    assert (found.needs_person, found.air_tau_s, found.is_driven) == (False, 120.0, True)
    assert found.real_rate_dps(100.0) == rig.table.achievable_dps(100.0)
    assert BenchLimits.of(rig).needs_person
    by_hand: Any = SimpleNamespace(table=None, chamber=None, supply=None, gyros=rig.gyros)
    bare = BenchLimits.of(by_hand, air_tau_s=60.0)
    assert (bare.table, bare.chamber, bare.achievable_dps, bare.needs_person) == (None, None, None, True)
    assert bare.air_tau_s == 60.0
    assert not BenchLimits.of(by_hand, needs_person=False).needs_person


def test_a_course_is_allowed_up_to_the_limit_of_the_unit(limits: BenchLimits) -> None:
    following = with_courses(limits)
    assert following.course_complaint(Ramp(0.0, 400.0, 100.0)) is None
    assert following.course_complaint(Ramp(0.0, -400.0, 100.0)) is None
    said = "reaches 400.5 deg/s, beyond the 400 deg/s of unit imu; make it slower"
    assert following.course_complaint(Ramp(0.0, 400.5, 100.0)) == said
    beyond_table = following.course_complaint(Ramp(0.0, 451.0, 100.0))
    assert beyond_table is not None
    assert "451" in beyond_table
    assert following.course_complaint(Ramp(0.0, 400.0, 1.0)) is not None  # 400 deg/s^2 of 200


def test_a_table_of_constant_rates_follows_no_course_unless_nothing_is_driven(limits: BenchLimits) -> None:
    course = SineSweep(10.0, 0.1, 1.0, 20.0)
    assert limits.course_complaint(course) == CONSTANT_ONLY
    assert replace(limits, is_driven=False).course_complaint(course) is None
    assert replace(limits, table=None).course_complaint(course) is None


def test_instruments_that_a_recipe_needs_are_named(limits: BenchLimits) -> None:
    table, chamber = missing_instruments(recipe(), BenchLimits(None, None, {}))
    assert table == "rates_dps: a rate table is needed, but the bench has none"
    assert chamber == "temperatures_c: a chamber is needed, but the bench has none"
    assert missing_instruments(recipe(), replace(limits, table=None)) == (table,)
    assert missing_instruments(recipe(), replace(limits, chamber=None)) == (chamber,)
    assert missing_instruments(recipe(), limits) == ()
    assert missing_instruments(read_recipe("by-hand"), BenchLimits(None, None, {})) == ()
    with pytest.raises(PlanRefused, match="a rate table is needed") as refused:
        fit_to_bench(recipe(), replace(limits, table=None), clip=True)
    assert NEEDS in str(refused.value)


def test_a_recipe_within_the_limits_stays_as_it_is(limits: BenchLimits) -> None:
    asked = recipe()
    fitted, left_out = fit_to_bench(asked, limits, clip=False)
    assert fitted is asked
    assert left_out == ()


def test_points_beyond_are_refused_and_left_out_with_clip(limits: BenchLimits) -> None:
    asked = recipe(temperatures_c=[20.0, 90.0], rates_dps=[10.0, 410.0])
    beyond = (
        "temperatures_c 90: outside the -40 to 85 deg C of unit imu",
        "rates_dps 410: beyond the 400 deg/s of unit imu",
    )
    with pytest.raises(PlanRefused) as refused:
        fit_to_bench(asked, limits, clip=False)
    assert refused.value.offenders == beyond
    assert ADVICE in str(refused.value)
    fitted, left_out = fit_to_bench(asked, limits, clip=True)
    assert left_out == beyond
    assert (fitted.temperatures_c, fitted.rates_dps) == ((20.0,), (10.0,))


def test_a_list_that_would_become_empty_is_refused_also_with_clip(limits: BenchLimits) -> None:
    with pytest.raises(PlanRefused, match="Change the recipe") as refused:
        fit_to_bench(recipe(temperatures_c=[90.0]), limits, clip=True)
    assert refused.value.offenders == (
        "temperatures_c 90: outside the -40 to 85 deg C of unit imu",
        "temperatures_c: no value is left within the limits",
    )


def test_the_temperature_of_handling_has_to_be_in_reach(limits: BenchLimits) -> None:
    cold = replace(limits, gyros={"imu": GyroLimits(400, -40, 24)})
    with pytest.raises(PlanRefused, match=r"mounting\.handling_c 25: outside the -40 to 24 deg C of unit imu"):
        fit_to_bench(recipe(mounting={"handling_c": 25.0}), cold, clip=True)
    assert fit_to_bench(recipe(mounting={"handling_c": 24.0}), cold, clip=False)[1] == ()


def test_points_of_the_further_lists_are_within_the_limits_too(limits: BenchLimits) -> None:
    slow = replace(limits, table=TableLimits(100, 200, 0.225))
    asked = recipe(
        inverted={"temperatures_c": [20.0, 90.0], "rates_dps": [0.0, 200.0]},
        power_cycle={"rates_dps": [0.0, 200.0]},
    )
    fitted, left_out = fit_to_bench(asked, slow, clip=True)
    assert left_out == (
        "inverted.temperatures_c 90: outside the -40 to 85 deg C of unit imu",
        "inverted.rates_dps 200: beyond the 100 deg/s of the table",
        "power_cycle.rates_dps 200: beyond the 100 deg/s of the table",
    )
    assert fitted.inverted is not None
    assert fitted.power_cycle is not None
    assert (fitted.inverted.temperatures_c, fitted.inverted.rates_dps) == ((20.0,), (0.0,))
    assert fitted.power_cycle.rates_dps == (0.0,)


RAMPS = [
    {"kind": "ramp", "from_dps": 0.0, "to_dps": to_dps, "duration_s": 20.0}
    for to_dps in (100.0, 420.0)
]  # fmt: skip


def test_courses_beyond_are_named_by_their_number_and_left_out_with_clip(limits: BenchLimits) -> None:
    asked = recipe(profiles=RAMPS)
    with pytest.raises(PlanRefused, match=r"profiles\[1\], a ramp from \+0 to \+420 deg/s") as refused:
        fit_to_bench(asked, with_courses(limits), clip=False)
    assert len(refused.value.offenders) == 1
    fitted, left_out = fit_to_bench(asked, with_courses(limits), clip=True)
    assert len(left_out) == 1
    assert [each.course.largest_dps for each in fitted.profiles] == [100.0]


def test_a_table_that_follows_no_course_is_named_once(limits: BenchLimits) -> None:
    with pytest.raises(PlanRefused) as refused:
        fit_to_bench(recipe(profiles=RAMPS), limits, clip=False)
    assert refused.value.offenders == (f"profiles: {CONSTANT_ONLY}",)
    assert fit_to_bench(recipe(profiles=RAMPS), limits, clip=True)[0].profiles == ()
