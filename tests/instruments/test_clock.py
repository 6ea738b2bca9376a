"""The paced clock: at most as fast as asked, late where the computer is, exact for every thread that sleeps on it."""

from __future__ import annotations

import itertools
import math
import random
import threading
from datetime import UTC, datetime, timedelta

import pytest

from instruments.clock import PacedClock, VirtualClock
from tests.helpers.virtual_wall import VirtualWall

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
JOIN_S = 100.0


def clock_of(wall: VirtualWall, speed: float = math.inf) -> PacedClock:
    return PacedClock(speed, start=AT, wall=wall)


def run(clock: PacedClock, wall: VirtualWall, *, sleeps: int, sleep_s: float, computing_s: float) -> None:
    """Sleep many times, with a computation that takes real time after each."""
    for _ in range(sleeps):
        clock.sleep(sleep_s)
        wall.pass_s(computing_s)


@pytest.mark.parametrize("speed", [0.5, 1.0, 200.0])
@pytest.mark.parametrize("sleep_s", [0.0007, 0.03, 40.0])
def test_the_clock_is_no_faster_than_its_speed(speed: float, sleep_s: float) -> None:
    wall = VirtualWall()
    clock = clock_of(wall, speed)
    for _ in range(500):
        clock.sleep(sleep_s)
        assert clock.now_s() <= speed * (wall.now_s() + PacedClock.MIN_WAIT_S) + 1e-9
    assert clock.now_s() == pytest.approx(500 * sleep_s)
    assert wall.now_s() == pytest.approx(clock.now_s() / speed, abs=PacedClock.MIN_WAIT_S)


@pytest.mark.parametrize("speed", [3.0, math.inf])
def test_one_thread_reads_the_times_of_a_virtual_clock(speed: float) -> None:
    rng, wall, virtual = random.Random(5), VirtualWall(), VirtualClock(AT)
    clock = clock_of(wall, speed)
    for _ in range(300):
        duration_s = rng.choice([1e-6, rng.random(), 30.0 * rng.random()])
        wall.pass_s(0.2 * rng.random())
        virtual.sleep(duration_s)
        clock.sleep(duration_s)
        assert (clock.now_s(), clock.utc()) == (virtual.now_s(), virtual.utc())


def test_a_computation_takes_no_time_of_the_clock_and_is_caught_up_only_for_a_moment() -> None:
    wall = VirtualWall()
    clock = clock_of(wall, 10.0)
    clock.sleep(5.0)
    wall.pass_s(60.0)  # the process stands still
    assert clock.now_s() == 5.0
    began_s = wall.now_s()
    for _ in range(200):
        clock.sleep(0.1)
    assert wall.now_s() - began_s == pytest.approx(20.0 / 10.0 - PacedClock.BACKLOG_S, abs=0.003)


def test_a_short_delay_is_caught_up() -> None:
    wall = VirtualWall()
    clock = clock_of(wall, 10.0)
    run(clock, wall, sleeps=50, sleep_s=1.0, computing_s=0.9 * PacedClock.BACKLOG_S)
    assert clock.now_s() == pytest.approx(10.0 * wall.now_s(), rel=0.03)


def test_the_clock_tells_the_speed_that_it_reaches() -> None:
    wall = VirtualWall()
    clock = clock_of(wall, 100.0)
    clock.sleep(99.0)
    assert clock.reached_speed is None  # in the first second
    clock.sleep(1000.0)
    assert clock.reached_speed == pytest.approx(100.0)
    run(clock, wall, sleeps=300, sleep_s=1.0, computing_s=0.05)  # the computer is too slow
    assert clock.reached_speed == pytest.approx(20.0, rel=0.05)
    clock.sleep(2000.0)  # it keeps up again
    assert clock.reached_speed == pytest.approx(100.0)
    wall.pass_s(90.0)
    assert clock.reached_speed == pytest.approx(0.0, abs=1.0)  # nothing moves any more


@pytest.mark.parametrize("speed", [1000.0, math.inf])
def test_other_threads_get_room_where_the_computer_is_too_slow(speed: float) -> None:
    wall = VirtualWall()
    clock = clock_of(wall, speed)
    wall.pass_s(1.0)
    run(clock, wall, sleeps=1000, sleep_s=1.0, computing_s=0.0015)
    given_s = [each for each in wall.waits_s if each == PacedClock.GIVE_WAY_S]
    assert len(given_s) * PacedClock.GIVE_WAY_EVERY_S >= 0.6 * 1000 * 0.0015
    assert sum(wall.waits_s) < 0.2 * 1000 * 0.0015


def test_a_long_sleep_is_seen_to_pass() -> None:
    wall, seen = VirtualWall(), list[tuple[float, datetime]]()
    clock = clock_of(wall, 2.0)
    wall.meanwhile[threading.current_thread().name] = lambda _: seen.append((clock.now_s(), clock.utc()))
    clock.sleep(30.0)
    assert len(seen) == pytest.approx(30.0 / 2.0 / PacedClock.STEP_S, abs=2)
    times_s = [t_s for t_s, _ in seen]
    assert times_s == sorted(times_s)
    assert max(after - before for before, after in itertools.pairwise(times_s)) < 0.21
    assert seen[-1][1] == AT + timedelta(seconds=seen[-1][0])


def test_sleeps_of_two_threads_overlap_and_each_ends_exactly() -> None:
    wall, seen_s, held = VirtualWall(), list[float](), list[threading.Condition]()
    clock = clock_of(wall, 1.0)
    sleeping, may_wake, woke = threading.Event(), threading.Event(), threading.Event()

    def short_sleep() -> None:
        clock.sleep(1.0)
        seen_s.append(clock.now_s())
        woke.set()

    def not_yet(changed: threading.Condition) -> None:
        held.append(changed)
        sleeping.set()
        changed.wait_for(may_wake.is_set)

    def let_it_wake(changed: threading.Condition) -> None:
        if clock.now_s() >= 1.0 and not woke.is_set():  # its end has come, and this thread has to wait for it
            may_wake.set()
            changed.notify_all()
            changed.wait_for(woke.is_set, 0.01)

    thread = threading.Thread(target=short_sleep, name="short")
    wall.meanwhile = {"short": not_yet, threading.current_thread().name: let_it_wake}
    thread.start()
    assert sleeping.wait(JOIN_S)
    clock.sleep(5.0)
    with held[0]:
        may_wake.set()
        held[0].notify_all()
    thread.join(JOIN_S)
    assert (seen_s, clock.now_s()) == ([1.0], 5.0)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="give a number above 0"):
        PacedClock(speed)


def test_a_start_without_time_zone_is_refused() -> None:
    with pytest.raises(ValueError, match="has no time zone"):
        PacedClock(start=datetime(2026, 1, 5))  # noqa: DTZ001  that is what is refused
