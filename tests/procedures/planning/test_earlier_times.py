"""What earlier campaigns took decides the forecast of a plan, and nothing of what it does."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import theilslopes

from labctl.services.planning.loading import limits_of, load_bench
from procedures.contracts.steps import Acquire, CheckHome, Home, MeasureClock, Mount, MoveChamber, Step
from procedures.planning.chamber_time import move_s
from procedures.planning.earlier_times import DoneStep, EarlierTimes, earlier_times
from procedures.planning.plan import make_plan
from procedures.planning.step_writer import HOMING_S, MOUNTING_S
from procedures.recipe.recipe import read_recipe

STATED = 5.0  #: ramp of the bench file, K/min


def moved(campaign: int, to_c: float, took_s: float) -> DoneStep:
    return DoneStep(campaign, MoveChamber(temperature_c=to_c, band_c=0.5, timeout_s=1e4, expected_s=1.0), took_s)


def drive(campaign: int, temperatures_c: list[float], heating: float, cooling: float, tau_s: float) -> list[DoneStep]:
    """Return the moves of a chamber that follows its ramps, K/min, with a first-order lag."""
    found = [moved(campaign, temperatures_c[0], 777.0)]
    for from_c, to_c in pairwise(temperatures_c):
        ramp = heating if to_c > from_c else cooling
        found.append(moved(campaign, to_c, move_s(abs(to_c - from_c), ramp, 0.5, tau_s)))
    return found


def test_ramp_and_settling_of_a_chamber_that_is_slower_than_stated_are_found() -> None:
    done = drive(1, [20, 60, 10, 25, -20, 40], 3.0, 1.5, 240.0) + drive(2, [-40, 20, 0, 70], 3.0, 1.5, 240.0)
    found = earlier_times(done, STATED)
    assert found is not None
    assert found.heating is not None
    assert found.cooling is not None
    assert found.campaigns == 2
    assert (found.heating.moves, found.cooling.moves) == (5, 3)  # the first of a campaign began at no known temperature
    assert found.heating.ramp_c_per_min == pytest.approx(3.0, rel=0.02)
    assert found.cooling.ramp_c_per_min == pytest.approx(1.5, rel=0.02)
    for way_c in (20.0, 45.0, 80.0):
        assert found.heating.move_s(way_c, STATED) == pytest.approx(move_s(way_c, 3.0, 0.5, 240.0), rel=0.05)
        assert found.cooling.move_s(way_c, STATED) == pytest.approx(move_s(way_c, 1.5, 0.5, 240.0), rel=0.05)


def test_the_line_is_that_of_scipy_and_a_long_pause_does_not_move_it() -> None:
    rng = np.random.default_rng(4)
    ways = rng.uniform(10.0, 80.0, 15)
    took_s = 60.0 * ways / 2.0 + 300.0 + rng.normal(0.0, 20.0, 15)
    took_s[3] += 50_000.0  # paused over night
    done = [each for n in range(15) for each in (moved(n, 0.0, 1.0), moved(n, float(ways[n]), float(took_s[n])))]
    found = earlier_times(done, STATED)
    assert found is not None
    assert found.heating is not None
    slope = theilslopes(took_s, ways).slope
    assert found.heating.ramp_c_per_min == pytest.approx(60.0 / slope, rel=0.05)  # ways that are nearly alike are left
    assert found.heating.move_s(40.0, STATED) == pytest.approx(60.0 * 40.0 / 2.0 + 300.0, rel=0.05)


def test_moves_of_one_way_tell_the_settling_at_the_stated_ramp() -> None:
    found = earlier_times(drive(1, [20, 40, 60, 80], STATED, STATED, 180.0), STATED)
    assert found is not None
    assert found.heating is not None
    assert found.heating.ramp_c_per_min is None
    assert found.heating.move_s(20.0, STATED) == pytest.approx(move_s(20.0, STATED, 0.5, 180.0))
    assert found.cooling is None
    assert found.moves(-20.0) is found.heating  # better than nothing
    assert earlier_times([], STATED) is None
    assert earlier_times([moved(1, 40.0, 600.0)], STATED) is None


def test_steps_of_a_plan_are_the_same_and_take_what_they_took() -> None:
    """Also where the times would have the step clock measured at another place, had they decided what is done."""
    bench = load_bench("single-axis-sim")
    sections = bench.table
    assert sections is not None
    limits = replace(limits_of(bench), needs_person=True)
    assert limits.table is not None
    limits = replace(limits, table=replace(limits.table, clock_run_s=60.0, checks_home=True))
    heating = earlier_times(drive(1, [0, 60, 20, 80], 0.7, 0.4, 600.0), 1.0)
    assert heating is not None
    earlier = replace(heating, home_s=55.0, check_home_s=41.0, mount_s=1234.0)
    plain = make_plan(read_recipe("informative"), limits, clip=True)
    learned = make_plan(read_recipe("informative"), replace(limits, earlier=earlier), clip=True)
    assert learned.schedule_hash == plain.schedule_hash
    assert sum(isinstance(step, MeasureClock) for step in plain.steps) > 2

    def took(kind: type[Step], steps: tuple[Step, ...]) -> set[float]:
        return {step.expected_s for step in steps if isinstance(step, kind)}

    assert (took(Home, plain.steps), took(Home, learned.steps)) == ({HOMING_S}, {55.0})
    assert (took(Mount, plain.steps), took(Mount, learned.steps)) == ({MOUNTING_S}, {1234.0})
    assert took(CheckHome, learned.steps) == {41.0}
    assert took(Acquire, learned.steps) == took(Acquire, plain.steps)
    assert max(took(MoveChamber, learned.steps)) > 1.5 * max(took(MoveChamber, plain.steps))


def test_by_hand_a_person_places_the_units_faster_than_on_a_table() -> None:
    mount = Mount(position="z", mounting=1, run=1, expected_s=1.0)
    by_hand = [DoneStep(2, mount, 40.0)] * 3
    on_table = [DoneStep(1, Home(expected_s=1.0), 22.0), DoneStep(1, mount, 500.0)]
    assert earlier_times(by_hand, STATED) is None
    assert earlier_times(on_table + by_hand, STATED) == EarlierTimes(2, home_s=22.0, mount_s=500.0)
