"""Recipe + bench + units -> the whole list of steps with expected times, written down before the first move."""

from __future__ import annotations

import hashlib
import json
import math
from typing import Literal

from pydantic import BaseModel, ConfigDict

from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import (
    Acquire,
    Home,
    Mount,
    MoveChamber,
    PowerOff,
    PowerOn,
    Rest,
    SafeState,
    Soak,
    Step,
)
from procedures.planning.limits import BenchLimits, fit_to_bench
from procedures.planning.point_order import Level, MountingBlock, schedule
from procedures.recipe.recipe import Recipe

# What is expected of things that have no limit to compute with; only the forecast hangs on them.
ROOM_C = 25.0
CHAMBER_SETTLING_S = 300.0  #: from the end of the ramp until the air is in the band
HOMING_S = 30.0
MOST_DATASETS = 100_000  #: half a year of data sets of two minutes
MOUNTING_S = 600.0  #: a person walks up, turns the units and confirms

_BENCH_FIGURES = {"expected_s"}  #: what depends on the bench's speed, not on what is done


class Plan(BaseModel):
    """Everything a campaign will do, in order. The steps never change once the campaign has begun."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["labctl-plan/1"] = "labctl-plan/1"
    recipe: Recipe  #: as run: without what was clipped
    steps: tuple[Step, ...]
    clipped: tuple[str, ...] = ()  #: points left out, each with the limit that it passes

    @property
    def expected_s(self) -> float:
        """How long the whole plan takes, as far as it can be foreseen."""
        return math.fsum(step.expected_s for step in self.steps)

    @property
    def datasets(self) -> int:
        """How many data sets the plan takes."""
        return sum(isinstance(step, Acquire) for step in self.steps)

    @property
    def schedule_hash(self) -> str:
        """SHA-256 over what is done in which order: equal on two benches that run the same steps."""
        steps = [step.model_dump(exclude=_BENCH_FIGURES) for step in self.steps]
        text = json.dumps(steps, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def expected_by_kind_s(self) -> dict[str, float]:
        """Return the expected seconds per kind of step."""
        kinds: dict[str, float] = {step.kind: 0.0 for step in self.steps}
        for step in self.steps:
            kinds[step.kind] += step.expected_s
        return kinds

    def lead_in(self, index: int) -> tuple[Step, ...]:
        """Return what has to be done again before step `index` can be run from cold: home, temperature, soak.

        For taking up a campaign in the middle. The mounting is as it was left, so no Mount is among them. What the
        step does itself is not done before it: no temperature before one that sets another.
        """
        if index >= len(self.steps) or isinstance(self.steps[index], SafeState):
            return ()
        if isinstance(self.steps[index], Home | MoveChamber):
            return (Home(),)
        before = self.steps[:index]
        move = next((step for step in reversed(before) if isinstance(step, MoveChamber)), None)
        soak = None
        if not isinstance(self.steps[index], Acquire | Rest):
            return (Home(), *((move,) if move else ()))
        for step in reversed(before):
            if isinstance(step, Mount | MoveChamber | PowerOn | PowerOff):
                break
            if isinstance(step, Soak):
                soak = step
                break
        return (Home(), *(each for each in (move, soak) if each is not None))

    def mounted_at(self, index: int) -> str | None:
        """Return the position in which the units are before step `index`; None when nobody has turned them yet."""
        mounts = [step.position for step in self.steps[:index] if isinstance(step, Mount)]
        return mounts[-1] if mounts else None

    def left_out_with(self, index: int) -> tuple[int, ...]:
        """Return the steps that make no sense without the mounting of step `index`: its temperatures and data sets.

        A switching-on among them goes too where the next mounting switches on anew.
        """
        mount = self.steps[index]
        assert isinstance(mount, Mount)
        of_it = [
            n for n, step in enumerate(self.steps) if isinstance(step, Acquire) and step.mounting == mount.mounting
        ]
        end = max(of_it, default=index)
        later = next((step for step in self.steps[end + 1 :] if isinstance(step, PowerOn | Acquire)), None)
        kinds: tuple[type, ...] = (Acquire, Soak, MoveChamber, Rest)
        kinds = kinds if isinstance(later, Acquire) else (*kinds, PowerOn, PowerOff)
        return tuple(n for n in range(index + 1, end + 1) if isinstance(self.steps[n], kinds))

    def run_at(self, index: int, skipped: frozenset[int] = frozenset()) -> int:
        """Return the number of the powered session in force at step `index`; 0 when the units are off."""
        return _powered(tuple(step for n, step in enumerate(self.steps[:index]) if n not in skipped))


def _powered(steps: tuple[Step, ...]) -> int:
    for step in reversed(steps):
        if isinstance(step, PowerOn):
            return step.run
        if isinstance(step, PowerOff):
            return 0
    return 0


def make_plan(recipe: Recipe, limits: BenchLimits, *, clip: bool = False) -> Plan:
    """Return the whole plan of a recipe on a bench.

    Raises PlanRefused listing every rate and temperature beyond a limit; with `clip` those points are left out instead
    and named in `Plan.clipped`.
    """
    _refuse_endless(recipe)
    runnable, clipped = fit_to_bench(recipe, limits, clip=clip)
    writer = _Writer(runnable, limits)
    writer.write()
    return Plan(recipe=runnable, steps=tuple(writer.steps), clipped=clipped)


def _refuse_endless(recipe: Recipe) -> None:
    """Refuse what no bench would ever finish, before it is written down step by step."""
    rates = len(recipe.rates_dps) * (recipe.repeats + 1)
    asked = len(recipe.positions) * (len(recipe.temperatures_c) + 1) * rates
    if recipe.inverted is not None:
        asked += len(recipe.positions) * len(recipe.inverted.temperatures_c) * len(recipe.inverted.rates_dps)
    if recipe.power_cycle is not None:
        asked += recipe.power_cycle.count * len(recipe.power_cycle.rates_dps)
    if asked > MOST_DATASETS:
        text = f"about {asked} data sets, where a campaign has at most {MOST_DATASETS}"
        raise PlanRefused(recipe.name, [text], "Ask for fewer rates, temperatures or repeats.")


class _Writer:
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

    def write(self) -> None:
        self.steps.append(Home(expected_s=HOMING_S))
        for stay in schedule(self.recipe):
            self.mount(stay)
            for level in stay.levels:
                self.move_chamber(level.temperature_c)
                self.soak(level.temperature_c)
                self.acquire(level)
        self.power_cycles()
        self.steps.append(SafeState())

    def mount(self, stay: MountingBlock) -> None:
        """Turn the units: chamber to where it can be opened, off if the recipe says so, turn, on."""
        if (handling_c := self.recipe.mounting.handling_c) is not None:
            self.move_chamber(handling_c)
        repower = self.run == 0 or (self.recipe.mounting.repower_each and not stay.same_session)
        if self.run and repower:
            self.steps.append(PowerOff(run=self.run))
        self.position = stay.position
        self.mounting += 1
        next_run = self.run + 1 if repower else self.run
        mount = Mount(position=stay.position, mounting=self.mounting, run=next_run, expected_s=MOUNTING_S)
        self.steps.append(mount)
        if repower:
            self.power_on()

    def power_on(self) -> None:
        self.run += 1
        warm_up_s = self.recipe.warm_up_s
        self.steps.append(PowerOn(run=self.run, wait_s=warm_up_s, expected_s=warm_up_s))

    def move_chamber(self, temperature_c: float) -> None:
        rules = self.recipe.soak
        way_c = abs(temperature_c - self.air_c)
        expected_s = 60.0 * way_c / self.limits.chamber.ramp_c_per_min
        if way_c > rules.band_c:
            expected_s += CHAMBER_SETTLING_S
        self.air_c = temperature_c
        self.steps.append(
            MoveChamber(
                temperature_c=temperature_c,
                band_c=rules.band_c,
                timeout_s=rules.move_timeout_s,
                expected_s=expected_s,
            )
        )

    def soak(self, temperature_c: float) -> None:
        rules = self.recipe.soak
        self.steps.append(
            Soak(
                temperature_c=temperature_c,
                hold_s=rules.hold_s,
                band_c=rules.band_c,
                max_drift_c=rules.max_drift_c,
                drift_window_s=rules.drift_window_s,
                timeout_s=rules.timeout_s,
                expected_s=max(rules.hold_s, rules.drift_window_s),
            )
        )

    def acquire(self, level: Level) -> None:
        for rate_dps in level.rates_dps:
            self.datasets += 1
            real_dps = self.limits.real_rate_dps(rate_dps)
            duration_s = planned_duration_s(self.recipe, real_dps)
            ramps_s = 2 * abs(real_dps) / self.limits.table.max_acceleration_dps2
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
                    expected_s=self.recipe.acquire.settle_s + duration_s + ramps_s,
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


def planned_duration_s(recipe: Recipe, rate_dps: float) -> float:
    """Return how long a data set at `rate_dps` lasts: the recipe's time, stretched to whole turns where it asks so."""
    rules = recipe.acquire
    if rules.whole_turns_above_dps is None or abs(rate_dps) < rules.whole_turns_above_dps * (1 - 1e-6):
        return rules.duration_s
    turn_s = 360.0 / abs(rate_dps)
    whole_s = math.ceil(rules.duration_s / turn_s - 1e-9) * turn_s
    return whole_s if whole_s <= rules.max_duration_s else rules.duration_s
