"""Guards: what trips them, what they say, and what a trip does to a campaign."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from procedures.contracts.campaign_state import CampaignState
from procedures.monitoring.bench_snapshot import ReadingCounts
from procedures.monitoring.guards import CHECKS, Guards
from procedures.planning.limits import BenchLimits
from procedures.recipe.rules import GuardRules
from tests.helpers.guard_trips import TRIPS, WELL


@pytest.fixture
def guards(limits: BenchLimits) -> Guards:
    return Guards(GuardRules(), limits)


def test_every_guard_has_a_case_here() -> None:
    assert {case[0] for case in TRIPS} == set(CHECKS)


def test_no_guard_trips_in_normal_conditions(guards: Guards) -> None:
    assert guards.check(WELL) == []


@pytest.mark.parametrize(("kind", "change", "device", "value", "limit", "unit"), TRIPS)
def test_a_trip_names_device_value_limit_and_unit(
    guards: Guards, kind: str, change: dict[str, Any], device: str, value: float, limit: float, unit: str
) -> None:
    trips = [trip for trip in guards.check(replace(WELL, **change)) if trip.kind == kind]
    assert len(trips) == 1
    event = trips[0].event()
    assert (event.device, event.value, event.limit, event.unit) == (
        device,
        pytest.approx(value),
        pytest.approx(limit),
        unit,
    )
    assert event.level == ("warning" if kind == "invalid_readings" else "error")
    assert device in event.message


#: Guard, the bench exactly at its limit, and the bench just beyond. The chamber has -70 to 150 deg C, the unit -40 to
#: 85 deg C; the margins are those of the rules.
BOUNDS = [
    ("chamber_limits", {"chamber_c": 152.0}, {"chamber_c": 152.01}),
    ("chamber_limits", {"chamber_c": -72.0}, {"chamber_c": -72.01}),
    ("unit_air", {"chamber_c": 87.0}, {"chamber_c": 87.01}),
    ("unit_air", {"chamber_c": -42.0}, {"chamber_c": -42.01}),
    ("unit_temperature", {"gyro_c": {"imu": 100.0}}, {"gyro_c": {"imu": 100.01}}),
    ("unit_temperature", {"gyro_c": {"imu": -55.0}}, {"gyro_c": {"imu": -55.01}}),
    ("chamber_deviation", {"chamber_c": 22.0}, {"chamber_c": 22.01}),
    ("chamber_deviation", {"chamber_c": 18.0}, {"chamber_c": 17.99}),
    ("unit_off_air", {"gyro_c": {"imu": 40.0}}, {"gyro_c": {"imu": 40.01}}),
    ("unit_off_air", {"gyro_c": {"imu": 0.0}}, {"gyro_c": {"imu": -0.01}}),
    ("stale", {"silent_s": {"imu": 30.0}}, {"silent_s": {"imu": 30.01}}),
    (
        "damaged_readings",
        {"counts": {"imu": ReadingCounts(1000, damaged=21)}},
        {"counts": {"imu": ReadingCounts(1000, damaged=22)}},
    ),
    (
        "invalid_readings",
        {"counts": {"imu": ReadingCounts(1000, invalid=501)}},
        {"counts": {"imu": ReadingCounts(1000, invalid=502)}},
    ),
    ("rate", {"rate_dps": 101.0}, {"rate_dps": 101.01}),
    ("rate", {"rate_dps": 99.0}, {"rate_dps": 98.99}),
    ("rate", {"asked_dps": -100.0, "rate_dps": -101.0}, {"asked_dps": -100.0, "rate_dps": 100.0}),
]


@pytest.mark.parametrize(("kind", "at_limit", "beyond"), BOUNDS)
def test_a_limit_is_allowed_and_what_is_beyond_it_trips(
    guards: Guards, kind: str, at_limit: dict[str, Any], beyond: dict[str, Any]
) -> None:
    assert kind not in [trip.kind for trip in guards.check(replace(WELL, **at_limit))]
    assert [trip.kind for trip in guards.check(replace(WELL, **beyond))].count(kind) == 1


def test_the_limit_that_is_named_is_the_one_that_was_passed(guards: Guards) -> None:
    low, high = (
        next(trip for trip in guards.check(replace(WELL, gyro_c={"imu": each_c})) if trip.kind == "unit_temperature")
        for each_c in (-60.0, 110.0)
    )
    assert (low.limit, high.limit) == (-55.0, 100.0)
    assert low.message == "imu: its own thermometer: -60 deg C, limit -55"


def test_every_watched_value_is_there_with_its_limits_while_all_is_well(guards: Guards) -> None:
    found = {(kind, each.device): each for kind, each in guards.watched(WELL)}
    assert {kind for kind, _ in found} == set(CHECKS)
    assert not any(each.is_beyond for each in found.values())
    air = found["chamber_limits", "chamber"]
    assert (air.value, air.low, air.high, air.unit) == (WELL.chamber_c, -72.0, 152.0, "deg C")
    silent = found["stale", "imu"]
    assert (silent.low, silent.high, silent.unit) == (-math.inf, 30.0, "s")
    assert (found["chamber_alarm", "chamber"].value, found["foreign_change", "chamber"].value) == (0.0, 0.0)


def test_what_is_watched_during_data_sets_only_is_not_there_between_them(guards: Guards) -> None:
    between = {
        kind for kind, _ in guards.watched(replace(WELL, taking_readings=False, counts={}, asked_dps=0.0, rate_dps=0.0))
    }
    assert set(CHECKS) - between == {
        "chamber_deviation", "unit_off_air", "damaged_readings", "invalid_readings", "rate"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("change", "kind", "is_watched"),
    [
        ({"attended": True}, "foreign_change", False),
        ({"rate_dps": 100.0}, "rate", True),
        ({"taking_readings": False, "rate_dps": 99.9}, "rate", True),
        ({"taking_readings": False, "rate_dps": 100.0}, "rate", False),
    ],
)
def test_a_value_is_watched_where_its_guard_could_trip(
    guards: Guards, change: dict[str, Any], kind: str, is_watched: bool
) -> None:
    assert (kind in {each for each, _ in guards.watched(replace(WELL, **change))}) is is_watched


def test_no_reading_is_expected_and_none_is_bad(guards: Guards) -> None:
    nothing = replace(WELL, counts={"imu": ReadingCounts(expected=0)})
    assert [each.value for kind, each in guards.watched(nothing) if kind == "damaged_readings"] == [0.0]


@pytest.mark.parametrize("change", [{"chamber_c": None}, {"setpoint_c": None}, {"chamber_c": None, "setpoint_c": None}])
def test_without_a_chamber_no_guard_of_the_air_trips(guards: Guards, change: dict[str, Any]) -> None:
    assert guards.check(replace(WELL, **change)) == []
    assert guards.check(replace(WELL, chamber_c=None, setpoint_c=None, gyro_c={"imu": 90.0})) == []


def test_limits_of_a_bench_without_a_chamber_trip_no_guard_of_it(limits: BenchLimits) -> None:
    trips = Guards(GuardRules(), replace(limits, chamber=None)).check(replace(WELL, chamber_c=200.0, setpoint_c=200.0))
    assert {trip.kind for trip in trips} == {"unit_air", "unit_off_air"}


@pytest.mark.parametrize(("action", "trips"), [("warn", True), ("suspend", False), ("fail", False)])
def test_air_that_follows_the_set_point_of_others_is_judged_by_the_guard_of_that(
    limits: BenchLimits, action: str, trips: bool
) -> None:
    guards = Guards(GuardRules.model_validate({"actions": {"foreign_change": action}}), limits)
    changed = replace(WELL, chamber_c=27.0, foreign=("the set point is 27 deg C, labctl gave 20 deg C",))
    kinds = {trip.kind for trip in guards.check(changed)}
    assert kinds == ({"foreign_change", "chamber_deviation"} if trips else {"foreign_change"})
    assert {trip.kind for trip in guards.check(replace(changed, foreign=()))} == {"chamber_deviation"}


def test_a_single_bad_reading_is_no_trend(guards: Guards) -> None:
    tally = ReadingCounts(expected=10, valid=9, damaged=1)
    assert guards.check(replace(WELL, counts={"imu": tally})) == []


def test_the_air_may_be_anywhere_while_nothing_is_measured(guards: Guards) -> None:
    assert guards.check(replace(WELL, chamber_c=-10.0, taking_readings=False)) == []


def test_at_rest_any_motion_is_a_wrong_rate(guards: Guards) -> None:
    assert [trip.kind for trip in guards.check(replace(WELL, asked_dps=0.0, rate_dps=0.01))] == ["rate"]
    turning, still = (
        {kind: each.title for kind, each in guards.watched(now)}
        for now in (WELL, replace(WELL, asked_dps=0.0, rate_dps=0.0))
    )
    assert (turning["rate"], still["rate"]) == ("rate error", "motion while at rest")


def test_a_guard_that_is_already_beyond_its_limit_trips_when_armed(rig: Any) -> None:
    rig.chamber.alarms = ("door open",)
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "door open" in outcome.reason
    assert rig.journal.steps == []  # before the first step
    rig.assert_safe()


def test_damage_during_a_data_set_trips_before_its_end(rig: Any) -> None:
    rig.when_step("acquire", lambda: setattr(rig.imu, "lost", 2))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "imu: readings lost or damaged" in outcome.reason
    assert [state for _, state, _ in rig.journal.closed] == ["partial", "partial"]  # and once more
    assert len(rig.journal.blocks) < 8
    event = next(event for event in rig.journal.events if event.kind == "guard.damaged_readings")
    assert (event.device, event.unit, event.limit) == ("imu", "%", 2.0)


def test_readings_that_the_instrument_marks_bad_are_kept_and_told_once(rig: Any) -> None:
    rig.imu.invalid = True
    assert rig.run().state == CampaignState.DONE
    assert rig.journal.kinds().count("guard.invalid_readings") == 4  # once per data set
    assert all(not readings.valid.any() for _, _, readings, _ in rig.journal.blocks)


def test_a_wrong_rate_is_caught_before_the_first_reading(rig: Any) -> None:
    rig.when_step("acquire", lambda: setattr(rig.table, "rate_error", 0.05))
    outcome = rig.run()
    assert outcome.state == CampaignState.FAILED
    assert "runs 21 deg/s instead of 20 deg/s" in outcome.reason
    assert [header.asked_dps for header in rig.journal.headers] == [0.0]


def test_air_that_leaves_its_set_point_suspends_then_soaks_again_and_redoes(rig: Any) -> None:
    began: list[float] = []

    def hook(what: str, _detail: Any) -> None:
        if what == "readings" and not began:
            began.append(rig.clock.now_s())

    rig.journal.hooks.append(hook)
    rig.chamber.disturbance_c = lambda t_s: 3.0 if began and began[0] < t_s < began[0] + 200 else 0.0
    recipe = rig.recipe(guards={"actions": {"chamber_deviation": "suspend"}}, acquire={"duration_s": 20.0})
    assert rig.run(recipe).state == CampaignState.DONE
    assert [state for state, _ in rig.journal.states] == ["running", "paused", "running", "done"]
    assert [state for _, state, _ in rig.journal.closed] == ["partial", *["complete"] * 4]
    assert [result.outcome for result in rig.journal.results()].count("interrupted") == 1
    again = rig.journal.headers[1]
    assert again.step.dataset == 1
    assert again.gate_from_s > began[0] - 1000.25 + 120  # soaked again first


def test_a_suspension_without_relief_fails_in_time(rig: Any) -> None:
    rig.when_step("soak", lambda: setattr(rig.chamber, "alarms", ("compressor",)))
    rules = {"actions": {"chamber_alarm": "suspend"}, "suspend_timeout_s": 600.0}
    outcome = rig.run(rig.recipe(guards=rules))
    assert outcome.state == CampaignState.FAILED
    assert "suspended for 600 s, the limit of the recipe, because: chamber: alarms (compressor)" in outcome.reason
    rig.assert_safe()


def test_a_worse_trip_ends_a_suspension(rig: Any) -> None:
    def act() -> None:
        rig.chamber.alarms = ("compressor",)
        rig.imu.lag_c = 80.0

    rig.when_step("soak", act)
    outcome = rig.run(rig.recipe(guards={"actions": {"chamber_alarm": "suspend"}}))
    assert outcome.state == CampaignState.FAILED
    assert "imu: its own thermometer" in outcome.reason


def test_a_trip_during_a_pause_suspends_too(rig: Any) -> None:
    paused: list[float] = []
    rig.when_step("acquire", rig.control.pause)

    def hook(what: str, detail: Any) -> None:
        if what == "state" and detail == CampaignState.PAUSED and not paused:
            paused.append(rig.clock.now_s())
            rig.chamber.alarms = ("compressor",)
        if what == "state" and "suspended" in rig.journal.states[-1][1]:
            rig.chamber.alarms = ()
            rig.control.resume()

    rig.journal.hooks.append(hook)
    outcome = rig.run(rig.recipe(guards={"actions": {"chamber_alarm": "suspend"}}))
    assert outcome.state == CampaignState.DONE
    assert "soak_again" in rig.journal.kinds()
    assert [header.step.dataset for header in rig.journal.headers] == [1, 2, 3, 4]
