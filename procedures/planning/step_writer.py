"""Writes the steps of a recipe down one after the other, with the time that each is expected to take."""

from __future__ import annotations

import math
from dataclasses import replace

from instruments.bench_config import USUAL_AIR_TAU_S
from procedures.contracts.steps import (
    Acquire,
    CheckHome,
    Home,
    MeasureClock,
    Mount,
    MoveChamber,
    PowerOff,
    PowerOn,
    SafeState,
    SetSupply,
    Soak,
    Step,
)
from procedures.planning.chamber_time import counted_move_s, move_s
from procedures.planning.clock_runs import BLOCK_EVERY_S, FIRST_RUNS, LATER_RUNS, run_lengths_s
from procedures.planning.limits import BenchLimits
from procedures.planning.point_order import Level, MountingBlock, order_points, verification_blocks
from procedures.planning.turn_steps import turn_steps
from procedures.recipe.recipe import Recipe
from procedures.recipe.rules import Ramp

# What is expected of things that have no limit to compute with; only the forecast depends on them.
ROOM_C = 25.0
HOMING_S = 30.0
CHECK_S = 10.0  #: back to home by counted steps, and the homing
CLOCK_SHORT_S = 10.0  #: steady part of the shorter run that measures the step clock
SUPPLY_S = 10.0  #: until the voltage of a supply was measured
MOUNTING_S = 600.0  #: a person walks up, turns the units and confirms; a unit handler takes no time


def write_steps(recipe: Recipe, limits: BenchLimits) -> tuple[Step, ...]:
    """Return the steps of a recipe that fits its bench, in order."""
    if recipe.turns is not None:
        return tuple(turn_steps(recipe, recipe.turns, needs_person=limits.needs_person))
    writer = _StepWriter(recipe, limits)
    writer.write()
    return tuple(writer.steps)


class _StepWriter:
    """Writes the steps down one after the other, keeping track of where the bench will be."""

    def __init__(self, recipe: Recipe, limits: BenchLimits) -> None:
        self.recipe = recipe
        self.limits = limits
        self.steps: list[Step] = []
        self.air_c = ROOM_C
        self.position: str = recipe.positions[0]
        self.mounting = 0
        self.run = 0
        self.datasets = 0
        self.has_ramped = False
        self.timed_runs = 0
        self.timed_at = 0
        self.not_counted_s = 0.0  #: by which moves of the chamber count as longer than they are expected to take

    def write(self) -> None:
        earlier = self.limits.earlier
        self.steps.append(Home(expected_s=_known(None if earlier is None else earlier.home_s, HOMING_S)))
        self.measure_clock(FIRST_RUNS)
        for block in order_points(self.recipe):
            self.measure(block)
        self.power_cycles()
        self.supply_steps()
        for block in verification_blocks(self.recipe):
            levels = tuple(Level(level.temperature_c, self.runnable(level.rates_dps)) for level in block.levels)
            self.measure(replace(block, levels=levels))
        if any(isinstance(step, Acquire) and step.rate_dps for step in self.steps[self.timed_at :]):
            self.measure_clock(LATER_RUNS)
        self.steps.append(SafeState())

    def runnable(self, drawn_dps: tuple[float, ...]) -> tuple[float, ...]:
        """Return drawn rates as the table can run them: the nearest it has, or rest."""
        allowed = self.recipe.guards.max_rate_error_fraction
        return tuple(0.0 if self.limits.rate_complaint(rate, allowed) else rate for rate in drawn_dps)

    def measure(self, block: MountingBlock) -> None:
        """Mount the units, and run the rates of each temperature."""
        self.mount(block)
        for level in block.levels:
            self.move_chamber(level.temperature_c)
            self.soak(level.temperature_c, block.hold_s)
            self.check_home(level)
            if not block.verification:
                self.follow()
            self.acquire(level, verification=block.verification)
            self.check_home(level)
            self.measure_clock_again()
        ramp = self.recipe.ramp
        if ramp is None or block.verification or block.position not in self.recipe.positions:
            return
        if ramp.moves_in(block.position):
            self.ramp(ramp)

    def ramp(self, rules: Ramp) -> None:
        """Soak at one temperature, and run rates while the chamber goes to others, one after the other."""
        self.move_chamber(rules.from_c)
        self.soak(rules.from_c)
        is_first = not self.has_ramped and rules.first_dwell_s is not None
        self.has_ramped = True
        dwell_s = rules.first_dwell_s if is_first else rules.dwell_s
        for leg, to_c in enumerate(rules.ends_c, start=1):
            from_c, way_c = self.air_c, to_c - self.air_c
            lasts_s = self._move_s(way_c, self.recipe.soak.band_c)
            if is_slow := rules.c_per_min is not None and rules.c_per_min < self.limits.ramp_c_per_min:
                lasts_s = 60.0 * abs(way_c) / (rules.c_per_min or 1.0)
            passed_s, number = 0.0, 0
            until_s = lasts_s + (dwell_s or 0.0 if leg < len(rules.ends_c) else 0.0)
            while passed_s < until_s:
                rate_dps = rules.rates_dps[number % len(rules.rates_dps)]
                next_s = passed_s + self._set_s(rate_dps)
                if number == 0 or (is_slow and passed_s < lasts_s):
                    share = min(next_s / lasts_s, 1.0) if is_slow else 1.0
                    self.move_chamber(round(from_c + share * way_c, 2), wait=False)
                self.acquire(Level(self.air_c, (rate_dps,)))
                passed_s, number = next_s, number + 1
            self.air_c = to_c
        self.check_home(Level(self.air_c, rules.rates_dps))

    def measure_clock(self, runs: int) -> None:
        """Time the step clock at the largest rate of the recipe, where the table does that."""
        rate_dps = max((abs(rate) for rate in self.recipe.rates_dps), default=0.0)
        table = self.limits.table
        if table is None or not table.clock_run_s or not rate_dps:
            return
        runs_s = run_lengths_s(runs, self.timed_runs, CLOCK_SHORT_S, table.clock_run_s)
        expected_s = sum(runs_s) + 2 * runs * rate_dps / table.max_acceleration_dps2
        step = MeasureClock(rate_dps=rate_dps, short_s=CLOCK_SHORT_S, runs_s=runs_s, expected_s=expected_s)
        self.steps.append(step)
        self.timed_runs += runs
        self.timed_at, self.not_counted_s = len(self.steps), 0.0

    def measure_clock_again(self) -> None:
        """Time it again where the last time was long ago."""
        since = self.steps[self.timed_at :]
        # as if a person mounted the units: what is done does not depend on who does
        each_s = [MOUNTING_S if isinstance(step, Mount) else step.expected_s for step in since]
        if math.fsum([*each_s, self.not_counted_s]) >= BLOCK_EVERY_S:
            self.measure_clock(LATER_RUNS)

    def check_home(self, level: Level) -> None:
        """Write a check for missed steps, where the table does that and turns at this level."""
        table = self.limits.table
        if table is not None and table.checks_home and any(level.rates_dps):
            earlier = self.limits.earlier
            expected_s = _known(None if earlier is None else earlier.check_home_s, CHECK_S)
            self.not_counted_s += CHECK_S - expected_s
            self.steps.append(CheckHome(temperature_c=level.temperature_c, expected_s=expected_s))

    def mount(self, block: MountingBlock) -> None:
        """Turn the units: chamber to where it can be opened, off if the recipe says so, turn, on."""
        if (handling_c := self.recipe.mounting.handling_c) is not None:
            self.move_chamber(handling_c)
        each = self.recipe.mounting.repower_each or block.verification
        repower = self.run == 0 or (each and not block.same_session)
        if self.run and repower:
            self.steps.append(PowerOff(run=self.run))
        place = self.limits.eccentricity
        self.position = block.position if place is None else place.mounted(block.position)
        self.mounting += 1
        next_run = self.run + 1 if repower else self.run
        earlier = self.limits.earlier
        by_person_s = _known(None if earlier is None else earlier.mount_s, MOUNTING_S)
        expected_s = by_person_s if self.limits.needs_person else 0.0
        mount = Mount(position=self.position, mounting=self.mounting, run=next_run, expected_s=expected_s)
        self.steps.append(mount)
        if repower:
            self.power_on()

    def power_on(self) -> None:
        self.run += 1
        warm_up_s = self.recipe.warm_up_s
        self.steps.append(PowerOn(run=self.run, wait_s=warm_up_s, expected_s=warm_up_s))

    def move_chamber(self, temperature_c: float, *, wait: bool = True) -> None:
        """Write a move of the chamber; without `wait` the next step begins at once."""
        rules = self.recipe.soak
        if not wait:
            self.air_c = temperature_c
            self.steps.append(
                MoveChamber(
                    temperature_c=temperature_c, band_c=rules.band_c, timeout_s=rules.move_timeout_s, wait=False
                )
            )
            return
        way_c = abs(temperature_c - self.air_c)
        ramp_c_per_min = self.limits.ramp_c_per_min
        expected_s = self._move_s(temperature_c - self.air_c, rules.band_c)
        self.not_counted_s += counted_move_s(way_c, ramp_c_per_min, rules.band_c) - expected_s
        self.air_c = temperature_c
        self.steps.append(
            MoveChamber(
                temperature_c=temperature_c,
                band_c=rules.band_c,
                timeout_s=rules.move_timeout_s,
                expected_s=expected_s,
            )
        )

    def _move_s(self, way_c: float, band_c: float) -> float:
        """Return how long a move of the chamber by `way_c` K is expected to take: as earlier ones, else computed."""
        limits, earlier = self.limits, self.limits.earlier
        known = None if earlier is None or abs(way_c) <= band_c else earlier.moves(way_c)
        if known is not None:
            return max(known.move_s(abs(way_c), limits.ramp_c_per_min), 0.0)
        return move_s(abs(way_c), limits.ramp_c_per_min, band_c, limits.air_tau_s or USUAL_AIR_TAU_S)

    def soak(self, temperature_c: float, hold_s: float | None = None) -> None:
        rules = self.recipe.soak
        held_s = rules.hold_s if hold_s is None else hold_s
        self.steps.append(
            Soak(
                temperature_c=temperature_c,
                hold_s=held_s,
                band_c=rules.band_c,
                max_drift_c=rules.max_drift_c,
                drift_window_s=rules.drift_window_s,
                timeout_s=rules.timeout_s,
                expected_s=max(held_s, rules.drift_window_s),
            )
        )

    def acquire(self, level: Level, *, verification: bool = False) -> None:
        for rate_dps in level.rates_dps:
            self.datasets += 1
            real_dps = self.limits.real_rate_dps(rate_dps)
            duration_s = planned_duration_s(self.recipe, real_dps)
            self.steps.append(
                Acquire(
                    dataset=self.datasets,
                    rate_dps=rate_dps,
                    temperature_c=level.temperature_c,
                    position=self.position,
                    run=self.run,
                    mounting=self.mounting,
                    settle_s=self.recipe.acquire.settle_s,
                    duration_s=duration_s,
                    expected_s=self._set_s(rate_dps),
                    verification=verification,
                )
            )

    def _set_s(self, rate_dps: float) -> float:
        """Return how long a data set at a rate is expected to take, s."""
        real_dps = self.limits.real_rate_dps(rate_dps)
        ramps_s = 2 * abs(real_dps) / self.limits.max_acceleration_dps2
        return self.recipe.acquire.settle_s + planned_duration_s(self.recipe, real_dps) + ramps_s

    def follow(self) -> None:
        """Take a data set of each course of the rate."""
        for profile in self.recipe.profiles:
            self.datasets += 1
            course = profile.course
            ramps_s = 2 * abs(course.begins_dps) / self.limits.max_acceleration_dps2
            self.steps.append(
                Acquire(
                    dataset=self.datasets,
                    rate_dps=0.0,
                    temperature_c=self.air_c,
                    position=self.position,
                    run=self.run,
                    mounting=self.mounting,
                    settle_s=self.recipe.acquire.settle_s,
                    duration_s=course.duration_s,
                    expected_s=self.recipe.acquire.settle_s + course.duration_s + ramps_s,
                    course=course,
                )
            )

    def power_cycles(self) -> None:
        """Switch off and on at the last level's temperature and measure the check rates again."""
        rules = self.recipe.power_cycle
        for _ in range(rules.count if rules else 0):
            assert rules is not None
            self.steps.append(PowerOff(run=self.run, off_s=rules.off_s, expected_s=rules.off_s))
            self.power_on()
            self.soak(self.air_c)
            self.acquire(Level(self.air_c, rules.rates_dps))

    def supply_steps(self) -> None:
        """Set one voltage of the supply after the other, run rates at each, and go back to the nominal voltage."""
        rules, supply = self.recipe.supply, self.limits.supply
        if rules is None or supply is None:
            return
        for time in range(self.recipe.repeats):
            for deviation_pct in rules.deviations_pct[:: -1 if time % 2 else 1]:
                self.set_supply(supply.voltage_v(deviation_pct), rules.settle_s)
                self.acquire(Level(self.air_c, rules.rates_dps))
        self.set_supply(supply.nominal_v, rules.settle_s)
        self.check_home(Level(self.air_c, rules.rates_dps))

    def set_supply(self, voltage_v: float, settle_s: float) -> None:
        self.steps.append(SetSupply(voltage_v=voltage_v, settle_s=settle_s, expected_s=settle_s + SUPPLY_S))


def _known(earlier_s: float | None, guess_s: float) -> float:
    return guess_s if earlier_s is None else earlier_s


def planned_duration_s(recipe: Recipe, rate_dps: float) -> float:
    """Return how long a data set at `rate_dps` lasts: the recipe's time, stretched to whole turns where it asks so."""
    rules = recipe.acquire
    if rules.whole_turns_above_dps is None or abs(rate_dps) < rules.whole_turns_above_dps * (1 - 1e-6):
        return rules.duration_s
    turn_s = 360.0 / abs(rate_dps)
    whole_s = math.ceil(rules.duration_s / turn_s - 1e-9) * turn_s
    return whole_s if whole_s <= rules.max_duration_s else rules.duration_s
