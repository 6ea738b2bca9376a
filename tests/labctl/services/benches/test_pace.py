"""The speed of simulated time: what a bench says of it, and when the log warns."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from instruments.clock import Clock, PacedClock, SystemClock, VirtualClock
from labctl.log.context import for_campaign
from labctl.services.benches.check import description
from labctl.services.benches.pace import SLOW_FOR_S, PaceWatch, with_pace_watch
from labctl.services.planning.loading import load_bench
from procedures.monitoring.progress import Progress
from tests.helpers.log_records import logged
from tests.helpers.virtual_wall import VirtualWall

SPEED = 200.0


def look_for(watch: PaceWatch, clock: PacedClock, wall: VirtualWall, wall_s: float, per_s: float) -> None:
    """Let a computer run a campaign that does `per_s` clock seconds per second, and compare its speeds."""
    until_s = wall.now_s() + wall_s
    while wall.now_s() < until_s:
        wall.pass_s(1.0 / per_s)
        clock.sleep(1.0)
        watch.look()


def test_a_clock_that_stays_behind_is_logged_once_and_again_when_that_changes(tmp_path: Path) -> None:
    wall = VirtualWall()
    clock = PacedClock(SPEED, wall=wall)
    watch = PaceWatch(clock, wall.clock)
    with logged(tmp_path) as records, for_campaign(3, "bench"):
        look_for(watch, clock, wall, 60.0, 10 * SPEED)
        assert records.all() == []
        for per_s in (37.0, 8.0, 10 * SPEED, 37.0):
            look_for(watch, clock, wall, 5 * SLOW_FOR_S, per_s)
    found = [each for each in records.all() if each["event"] == "clock.slow"]
    assert {(each["level"], each["asked"], each["campaign"], each["bench"]) for each in found} == {
        ("warning", SPEED, 3, "bench")
    }
    assert [each["reached"] for each in found] == [pytest.approx(each, rel=0.1) for each in (37.0, 8.0, 37.0)]


def test_a_short_delay_is_not_logged(tmp_path: Path) -> None:
    wall = VirtualWall()
    clock = PacedClock(SPEED, wall=wall)
    watch = PaceWatch(clock, wall.clock)
    with logged(tmp_path) as records:
        look_for(watch, clock, wall, 60.0, 10 * SPEED)
        look_for(watch, clock, wall, 3.0, 20.0)
        look_for(watch, clock, wall, 30.0, 100 * SPEED)
    assert records.all() == []


@pytest.mark.parametrize("clock", [PacedClock(), VirtualClock(), SystemClock()])
def test_what_has_no_speed_is_not_watched(clock: Clock) -> None:
    seen: list[Progress] = []
    assert with_pace_watch(clock, seen.append) == seen.append
    assert with_pace_watch(clock, None) is None
    assert description(load_bench("single-axis-sim"), 1, "", None, clock).speed is None


def test_an_observer_still_sees_the_progress() -> None:
    seen: list[Progress] = []
    observe = with_pace_watch(PacedClock(SPEED, wall=VirtualWall()), seen.append)
    assert observe is not None
    observe(Progress(steps=3))
    assert [each.steps for each in seen] == [3]


@pytest.mark.parametrize(("speed", "told"), [(SPEED, SPEED), (math.inf, None)])
def test_a_bench_says_which_speed_was_asked_for_and_which_is_reached(speed: float, told: float | None) -> None:
    wall = VirtualWall()
    clock = PacedClock(speed, wall=wall)
    bench = load_bench("single-axis-sim")
    assert description(bench, 1, "", None, clock).speed_reached is None  # not known yet
    for _ in range(1000):
        wall.pass_s(0.025)
        clock.sleep(1.0)
    described = description(bench, 1, "", None, clock)
    assert described.speed == told
    assert described.speed_reached == pytest.approx(40.0, rel=0.05)
    for other in (None, SystemClock()):
        idle = description(bench, None, "", None, other)
        assert (idle.speed, idle.speed_reached) == (None, None)
