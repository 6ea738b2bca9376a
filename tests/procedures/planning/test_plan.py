"""Plans: every point is visited as often as asked, limits are named, times are foreseen."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from instruments.errors import LimitError
from instruments.interfaces.gyro import GyroLimits
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Acquire, Mount, MoveChamber, PowerOff, PowerOn, SafeState, Soak, Turn
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.planning.point_order import level_rates, order_points, temperature_sequence
from procedures.recipe.recipe import Recipe, read_recipe, shipped_recipes


def kinds(plan: Plan) -> Counter[str]:
    return Counter(step.kind for step in plan.steps)


def acquires(plan: Plan) -> list[Acquire]:
    return [step for step in plan.steps if isinstance(step, Acquire)]


def recipe(**changes: Any) -> Recipe:
    values: dict[str, Any] = {
        "name": "r",
        "temperatures_c": [10.0, 20.0, 30.0],
        "rates_dps": [0.0, 5.0, -5.0],
        "positions": ["x", "y"],
    }
    return Recipe.model_validate(values | changes)


@pytest.mark.parametrize("name", shipped_recipes())
def test_every_shipped_recipe_plans_on_a_bench_that_suits_it(name: str, limits: BenchLimits) -> None:
    recipe = read_recipe(name)
    plan = make_plan(recipe, replace(limits, is_driven=not recipe.profiles))
    assert plan.clipped == ()
    assert isinstance(plan.steps[-1], SafeState)
    turns = [step for step in plan.steps if isinstance(step, Turn)]
    numbers = [*(step.dataset for step in acquires(plan)), *(s.dataset + part for s in turns for part in (-1, 0, 1))]
    assert numbers == list(range(1, plan.datasets + 1))


@pytest.mark.parametrize(("name", "datasets", "hours"), [("table1-x-table2", 630, 42), ("yang-23-rates", 690, 43)])
def test_yangs_campaigns_have_their_size_and_take_their_time(
    name: str, datasets: int, hours: float, limits: BenchLimits
) -> None:
    plan = make_plan(read_recipe(name), limits)
    assert plan.datasets == datasets
    counts = kinds(plan)
    assert (counts["soak"], counts["mount"], counts["power_on"]) == (30, 3, 3)
    expected_s = plan.expected_by_kind_s()
    assert (expected_s["soak"] + expected_s["acquire"]) / 3600 == pytest.approx(hours, abs=0.5)
    slow = make_plan(read_recipe(name), replace(limits, chamber=replace(limits.chamber, ramp_c_per_min=1.67)))
    ways_c = 3 * (65 + 90 + 25) - 25  # from room: down to -40, up to 50, back to 25; the last stays
    # behind a long ramp the air lags by r tau, and is in its band of 0.5 K after tau ln(r tau / 0.5 K)
    settling_s = 180 * math.log(1.67 / 60 * 180 / 0.5)
    assert slow.expected_by_kind_s()["move_chamber"] / 3600 == pytest.approx(
        ways_c / 1.67 / 60 + 32 * settling_s / 3600, abs=0.3
    )
    assert plan.expected_s == pytest.approx(math.fsum(step.expected_s for step in plan.steps))


def test_position_major_turns_the_units_once_per_position(limits: BenchLimits) -> None:
    plan = make_plan(recipe(), limits)
    assert [step.position for step in plan.steps if isinstance(step, Mount)] == ["x", "y"]
    assert kinds(plan)["soak"] == 6
    assert [step.mounting for step in acquires(plan)] == [1] * 9 + [2] * 9


def test_temperature_major_turns_them_at_every_temperature(limits: BenchLimits) -> None:
    plan = make_plan(recipe(order="temperature-major"), limits)
    assert [step.position for step in plan.steps if isinstance(step, Mount)] == ["x", "y"] * 3
    visits = [(step.temperature_c, step.position) for step in acquires(plan)][::3]
    assert visits == [(t, p) for t in (10, 20, 30) for p in ("x", "y")]


def test_a_unit_is_never_turned_to_where_it_already_is(limits: BenchLimits) -> None:
    plan = make_plan(recipe(order="temperature-major", positions=["z"]), limits)
    assert kinds(plan)["mount"] == 1


def test_the_chamber_is_where_a_person_can_open_it_before_every_turn(limits: BenchLimits) -> None:
    plan = make_plan(recipe(), limits)
    for index, step in enumerate(plan.steps):
        if isinstance(step, Mount):
            before = [each for each in plan.steps[:index] if isinstance(each, MoveChamber)]
            assert before[-1].temperature_c == 25.0
            after = [each for each in plan.steps[index:] if not isinstance(each, PowerOn)]
            assert [each.kind for each in after[1:3]] == ["move_chamber", "soak"]


def test_sessions_and_mountings_are_numbered(limits: BenchLimits) -> None:
    plan = make_plan(recipe(mounting={"repower_each": True}), limits)
    power = [(step.kind, step.run) for step in plan.steps if isinstance(step, PowerOn | PowerOff)]
    assert power == [("power_on", 1), ("power_off", 1), ("power_on", 2)]
    assert {(step.mounting, step.run) for step in acquires(plan)} == {(1, 1), (2, 2)}
    mounts = [(step.mounting, step.run) for step in plan.steps if isinstance(step, Mount)]
    assert mounts == [(1, 1), (2, 2)]


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("as_listed", (10, 30, 20, 40)),
        ("up", (10, 20, 30, 40)),
        ("down", (40, 30, 20, 10)),
        ("up_down", (10, 30, 40, 20)),
    ],
)
def test_temperature_orders(order: str, expected: tuple[float, ...]) -> None:
    listed = recipe(temperatures_c=[10.0, 30.0, 20.0, 40.0], temperature_order=order)
    assert temperature_sequence(listed) == expected
    again = recipe(
        temperatures_c=[10.0, 30.0, 20.0, 40.0],
        temperature_order=order,
        replicates={"first_temperature_again": True},
    )
    assert temperature_sequence(again) == (*expected, expected[0])


def test_the_informative_recipe_is_what_it_promises(limits: BenchLimits) -> None:
    plan = make_plan(read_recipe("informative"), limits)
    mounted = [step.position for step in plan.steps if isinstance(step, Mount)]
    assert mounted == ["x", "-x", "y", "-y", "z", "-z"]
    upright = [step for step in acquires(plan) if step.mounting == 1]
    temperatures = list(dict.fromkeys((step.temperature_c, index // 24) for index, step in enumerate(upright)))
    assert [t for t, _ in temperatures] == [-40, -20, 0, 20, 40, 50, 30, 10, -10, -30, -40]
    for level in range(11):
        rates = [step.rate_dps for step in upright[24 * level : 24 * level + 24]]
        assert (rates[0], rates[-1]) == (0.0, 0.0)
        assert abs(rates.index(0.0, 1) - 11.5) <= 1
        assert rates.count(0.0) == 3
        assert sorted(Counter(rates).values())[-2:] == [2, 3]  # one repeated rate, three standstills
    orders = {tuple(step.rate_dps for step in upright[24 * level : 24 * level + 24]) for level in range(11)}
    assert len(orders) == 11  # drawn anew at every level
    inverted = [step for step in acquires(plan) if step.position == "-x"]
    assert [step.rate_dps for step in inverted] == [0, 50, -50, 200, -200]
    assert {step.run for step in acquires(plan) if step.position in {"x", "-x", "y", "-y", "z"}} == {1}
    cycled = [step for step in acquires(plan) if step.run == 2]
    assert len(cycled) == 5
    assert {(step.position, step.temperature_c) for step in cycled} == {("-z", 20.0)}
    off = next(index for index, step in enumerate(plan.steps) if isinstance(step, PowerOff))
    assert [step.kind for step in plan.steps[off : off + 3]] == ["power_off", "power_on", "soak"]


def test_fast_data_sets_last_whole_turns(limits: BenchLimits) -> None:
    for step in acquires(make_plan(read_recipe("informative"), limits)):
        turns = abs(step.rate_dps) * step.duration_s / 360
        if abs(step.rate_dps) >= 6:
            assert turns == pytest.approx(round(turns), abs=1e-9)
            assert 60 - 1e-9 <= step.duration_s <= 180
        else:
            assert step.duration_s == 60


def test_a_turn_that_would_take_too_long_is_left_out(limits: BenchLimits) -> None:
    slow = recipe(rates_dps=[2.0, 4.0], acquire={"whole_turns_above_dps": 1.0, "max_duration_s": 100.0})
    assert {step.rate_dps: step.duration_s for step in acquires(make_plan(slow, limits))} == {2.0: 60.0, 4.0: 90.0}


def test_every_offender_is_named_with_its_limit(limits: BenchLimits) -> None:
    narrow = replace(
        limits,
        chamber=replace(limits.chamber, min_c=-20),
        table=replace(limits.table, max_rate_dps=250),
        gyros={"imu": GyroLimits(200, -40, 30)},
    )
    with pytest.raises(PlanRefused) as caught:
        make_plan(read_recipe("table1-x-table2"), narrow)
    offenders = caught.value.offenders
    assert len(offenders) == 2 + 2 + 6
    assert "temperatures_c -40: outside the -20 to 150 deg C of the chamber" in offenders
    assert "temperatures_c 50: outside the -40 to 30 deg C of unit imu" in offenders
    assert "rates_dps -250: beyond the 200 deg/s of unit imu" in offenders
    assert "rates_dps 300: beyond the 250 deg/s of the table and the 200 deg/s of unit imu" in offenders
    assert "--clip" in str(caught.value)
    assert "\n" not in str(caught.value)

    clipped = make_plan(read_recipe("table1-x-table2"), narrow, clip=True)
    assert clipped.clipped == offenders
    assert clipped.datasets == 3 * 6 * 15
    assert max(abs(step.rate_dps) for step in acquires(clipped)) == 200
    assert max(clipped.recipe.temperatures_c) == 30


def test_limits_are_inclusive(limits: BenchLimits) -> None:
    edge = replace(limits, gyros={"imu": GyroLimits(5, 10, 30)})
    assert make_plan(recipe(), edge).datasets == 18


def test_clipping_reaches_the_check_rates_and_the_inverted_mountings(limits: BenchLimits) -> None:
    slow = replace(limits, table=replace(limits.table, max_rate_dps=100), gyros={})
    plan = make_plan(read_recipe("informative"), slow, clip=True)
    assert "inverted.rates_dps 200: beyond the 100 deg/s of the table" in plan.clipped
    assert "power_cycle.rates_dps -200: beyond the 100 deg/s of the table" in plan.clipped
    assert max(abs(step.rate_dps) for step in acquires(plan)) == 100


def test_nothing_left_and_a_handling_temperature_out_of_reach_are_refused_even_when_clipping(
    limits: BenchLimits,
) -> None:
    cold = replace(limits, chamber=replace(limits.chamber, max_c=5))
    with pytest.raises(
        PlanRefused, match=r"temperatures_c: no value is left within the limits; mounting\.handling_c 25: outside"
    ):
        make_plan(recipe(), cold, clip=True)


def test_a_rate_that_the_step_clock_cannot_give_is_refused(limits: BenchLimits) -> None:
    def achievable(rate_dps: float) -> float:
        if abs(rate_dps) < 0.05:
            raise LimitError("table", f"{rate_dps} deg/s is slower than 0.05 deg/s")
        return math.copysign(round(abs(rate_dps)) or 1, rate_dps)

    coarse = replace(limits, achievable_dps=achievable)
    with pytest.raises(PlanRefused) as caught:
        make_plan(recipe(rates_dps=[0.0, 0.01, 0.1, 10.0]), coarse)
    assert len(caught.value.offenders) == 2
    assert "slower than 0.05 deg/s" in caught.value.offenders[0]
    assert "rates_dps 0.1: the nearest rate that the table can run is 1 deg/s" in caught.value.offenders[1]


def test_random_order_is_reproducible_and_hangs_on_the_seed(limits: BenchLimits) -> None:
    def rates(seed: int) -> list[float]:
        values = recipe(rates_dps=[float(n) for n in range(10)], rate_order="random", seed=seed)
        return [step.rate_dps for step in acquires(make_plan(values, limits))]

    assert rates(1) == rates(1)
    assert rates(1) != rates(2)
    assert rates(1)[:10] != rates(1)[10:20]


def test_a_plan_survives_json_and_its_hash_tells_what_is_done(limits: BenchLimits) -> None:
    plan = make_plan(read_recipe("informative"), limits)
    again = Plan.model_validate_json(plan.model_dump_json())
    assert again == plan
    assert again.schedule_hash == plan.schedule_hash
    slower = make_plan(read_recipe("informative"), replace(limits, chamber=replace(limits.chamber, ramp_c_per_min=1)))
    assert slower.expected_s > plan.expected_s
    assert slower.schedule_hash == plan.schedule_hash
    other = make_plan(read_recipe("informative").model_copy(update={"seed": 7}), limits)
    assert other.schedule_hash != plan.schedule_hash


def test_what_has_to_be_done_again_before_a_step(limits: BenchLimits) -> None:
    plan = make_plan(recipe(mounting={"repower_each": True}), limits)
    steps = plan.steps
    data = next(index for index, step in enumerate(steps) if isinstance(step, Acquire) and step.temperature_c == 20)
    lead = plan.lead_in(data + 1)
    assert [step.kind for step in lead] == ["home", "move_chamber", "soak"]
    assert {step.temperature_c for step in lead if isinstance(step, MoveChamber | Soak)} == {20.0}
    assert plan.run_at(data) == 1
    soak = next(index for index, step in enumerate(steps) if isinstance(step, Soak))
    assert [step.kind for step in plan.lead_in(soak)] == ["home", "move_chamber"]
    off = next(index for index, step in enumerate(steps) if isinstance(step, PowerOff))
    assert plan.run_at(off + 1) == 0
    assert [step.kind for step in plan.lead_in(off + 2)] == ["home", "move_chamber"]


numbers = st.floats(-300, 300, allow_nan=False).map(lambda value: round(value, 2) + 0.0)
points = st.builds(
    recipe,
    temperatures_c=st.lists(st.integers(-30, 80).map(float), min_size=1, max_size=6, unique=True),
    rates_dps=st.lists(numbers, min_size=1, max_size=8, unique=True),
    positions=st.lists(st.sampled_from(["x", "-x", "y", "-y", "z", "-z"]), min_size=1, max_size=4, unique=True),
    order=st.sampled_from(["position-major", "temperature-major"]),
    temperature_order=st.sampled_from(["as_listed", "up", "down", "up_down"]),
    rate_order=st.sampled_from(["as_listed", "ascending", "random"]),
    repeats=st.integers(1, 3),
    seed=st.integers(0, 2**32),
)


@given(points)
def test_every_requested_point_is_taken_exactly_as_often_as_asked(wanted: Recipe) -> None:
    from instruments.interfaces.chamber import ChamberLimits
    from instruments.interfaces.table import TableLimits

    bench = BenchLimits(TableLimits(450, 200, 0.225), ChamberLimits(-70, 150, 0.1, 10), {})
    plan = make_plan(wanted, bench)
    taken = Counter((step.position, step.temperature_c, step.rate_dps) for step in acquires(plan))
    asked = Counter(
        (position, temperature_c, rate_dps)
        for position in wanted.positions
        for temperature_c in wanted.temperatures_c
        for rate_dps in wanted.rates_dps
        for _ in range(wanted.repeats)
    )
    assert taken == asked
    levels = len(wanted.positions) * len(wanted.temperatures_c)
    assert kinds(plan)["soak"] == levels
    several = len(wanted.positions) > 1
    by_temperature = wanted.order == "temperature-major" and several
    assert kinds(plan)["mount"] == (levels if by_temperature else len(wanted.positions))
    mounted = Counter((step.mounting, step.position) for step in acquires(plan))
    assert len(mounted) == len({mounting for mounting, _ in mounted})  # one position per mounting


@given(
    rates=st.lists(numbers, min_size=1, max_size=8, unique=True),
    zero_at=st.sets(st.sampled_from(["start", "middle", "end"])),
    again=st.integers(0, 3),
    seed=st.integers(0, 1000),
)
def test_replicates_add_and_never_drop(rates: list[float], zero_at: set[str], again: int, seed: int) -> None:
    import numpy as np

    replicates = {"zero_rate": sorted(zero_at), "repeated_rates": again}
    wanted = recipe(rates_dps=rates, rate_order="random", replicates=replicates)
    taken = Counter(level_rates(wanted, wanted.rates_dps, np.random.default_rng(seed)))
    others = {rate for rate in rates if not (zero_at and rate == 0)}
    assert set(taken) - {0.0} == others - {0.0}
    if zero_at:
        assert taken[0.0] == len(zero_at)
    moving = [count for rate, count in taken.items() if rate in others]
    assert sum(moving) == len(others) + min(again, len(others))
    assert max(moving, default=0) <= 2


def test_a_schedule_is_the_same_however_often_it_is_asked_for() -> None:
    assert order_points(read_recipe("informative")) == order_points(read_recipe("informative"))


def by_hand(**changes: Any) -> Recipe:
    values: dict[str, Any] = {"name": "h", "positions": ["x", "-x"], "turns": {"turns_deg": [360, -720], "repeats": 2}}
    return Recipe.model_validate(values | changes)


def test_a_recipe_of_turns_drives_no_table_and_no_chamber(limits: BenchLimits) -> None:
    alone = replace(limits, table=None, chamber=None)
    plan = make_plan(by_hand(), alone)
    assert kinds(plan) == {"mount": 2, "power_on": 1, "turn": 8, "safe_state": 1}
    turns = [step for step in plan.steps if isinstance(step, Turn)]
    assert [(step.position, step.turn_deg) for step in turns[:5]] == [
        ("x", 360), ("x", -720), ("x", 360), ("x", -720), ("-x", 360),
    ]  # fmt: skip
    assert [step.dataset for step in turns[:3]] == [2, 5, 8]
    assert plan.datasets == 24
    assert turns[1].expected_s > turns[0].expected_s
    assert make_plan(by_hand(), limits).steps == plan.steps
    # a turn that is asked again after an interruption needs no home and no temperature before it
    assert plan.lead_in(3) == ()
    assert plan.left_out_with(0) == (2, 3, 4, 5)


def test_what_needs_a_table_or_a_chamber_says_which_is_missing(limits: BenchLimits) -> None:
    with pytest.raises(PlanRefused) as refused:
        make_plan(recipe(), replace(limits, table=None, chamber=None))
    assert refused.value.offenders == (
        "rates_dps: a rate table is needed, but the bench has none",
        "temperatures_c: a chamber is needed, but the bench has none",
    )
    assert "choose a recipe with [turns], such as by-hand, which needs neither" in str(refused.value)
    with pytest.raises(PlanRefused, match="a chamber is needed"):
        make_plan(recipe(), replace(limits, chamber=None), clip=True)


def test_turns_without_end_are_refused(limits: BenchLimits) -> None:
    with pytest.raises(PlanRefused, match="about 120000 data sets"):
        make_plan(by_hand(turns={"turns_deg": [360], "repeats": 20_000}), limits)


@pytest.mark.parametrize("name", ["by-hand", "short", "informative"])
def test_only_a_person_takes_time_to_mount_the_units(name: str, limits: BenchLimits) -> None:
    assert limits.table is not None
    timed = replace(limits, table=replace(limits.table, clock_run_s=60.0))
    by_person, by_handler = (
        make_plan(read_recipe(name), replace(timed, needs_person=needed)) for needed in (True, False)
    )
    mounts = [step for step in by_person.steps if isinstance(step, Mount)]
    assert all(step.expected_s > 0 for step in mounts)
    saved_s = math.fsum(step.expected_s for step in mounts)
    assert by_person.expected_s - by_handler.expected_s == pytest.approx(saved_s)
    assert by_handler.schedule_hash == by_person.schedule_hash
