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
    CheckHome,
    Home,
    MeasureClock,
    Mount,
    MoveChamber,
    PowerOff,
    PowerOn,
    Rest,
    SafeState,
    SetSupply,
    Soak,
    Step,
    Turn,
)
from procedures.planning.limits import BenchLimits, fit_to_bench
from procedures.planning.step_writer import write_steps
from procedures.planning.turn_steps import DATA_SETS_OF_TURN
from procedures.recipe.recipe import Recipe

MAX_DATASETS = 100_000  #: half a year of data sets of two minutes
_BENCH_FIGURES = {"expected_s"}  #: what depends on the bench's speed, not on what is done


class Plan(BaseModel):
    """Everything a campaign will do, in order. The steps never change once the campaign has begun."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

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
        turns = sum(isinstance(step, Turn) for step in self.steps)
        return sum(isinstance(step, Acquire) for step in self.steps) + DATA_SETS_OF_TURN * turns

    @property
    def fitted_datasets(self) -> int:
        """How many data sets at rates of the table a calibration is fitted to."""
        return sum(isinstance(step, Acquire) and not step.verification for step in self.steps)

    @property
    def verification_steps(self) -> tuple[Step, ...]:
        """The steps that verify, from their first mounting on; none where the recipe has no verification part."""
        mountings = {step.mounting for step in self.steps if isinstance(step, Acquire) and step.verification}
        first = next((n for n, s in enumerate(self.steps) if isinstance(s, Mount) and s.mounting in mountings), None)
        return () if first is None else self.steps[first:]

    @property
    def schedule_hash(self) -> str:
        """SHA-256 over what is done in which order: equal on two benches that run the same steps."""
        steps = [step.model_dump(exclude=_BENCH_FIGURES | _unset(step)) for step in self.steps]
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

        For resuming a campaign in the middle. The mounting is unchanged, so no Mount is among them. What the
        step does itself is not done before it: no temperature before one that sets another. The safe state has left
        the supply at its nominal voltage.
        """
        steps, supply = self._lead_in(index), self._supply_before(index)
        if supply is None:
            return steps
        soaks = tuple(step for step in steps if isinstance(step, Soak))
        return (*(step for step in steps if step not in soaks), supply, *soaks)

    def _supply_before(self, index: int) -> SetSupply | None:
        """Return the step that set the voltage at which step `index` runs; None where it is the nominal one."""
        if index >= len(self.steps) or isinstance(self.steps[index], SafeState | SetSupply | PowerOn):
            return None
        for step in reversed(self.steps[:index]):
            if isinstance(step, PowerOn):
                return None
            if isinstance(step, SetSupply):
                return step
        return None

    def _lead_in(self, index: int) -> tuple[Step, ...]:
        if index >= len(self.steps) or isinstance(self.steps[index], SafeState) or not self._drives:
            return ()
        before = self.steps[:index]
        home: tuple[Step, ...] = (Home(), *[step for step in before if isinstance(step, MeasureClock)][:1])
        if isinstance(self.steps[index], Home | MeasureClock):
            return (Home(),)
        moves = [step for step in before if isinstance(step, MoveChamber)]
        begin = next((step for step in reversed(moves) if step.wait), None)
        this = self.steps[index]
        if isinstance(this, MoveChamber):
            return home if this.wait or begin is None else (*home, begin)
        move = moves[-1] if moves else None
        soak = None
        if not isinstance(this, Acquire | Rest):
            return (*home, *((move,) if move else ()))
        if move is not None and not move.wait:  # from where the ramp began to where it was; its temperature is logged
            return (*home, *((begin,) if begin else ()), move)
        for step in reversed(before):
            if isinstance(step, Mount | MoveChamber | PowerOn | PowerOff):
                break
            if isinstance(step, Soak):
                soak = step
                break
        return (*home, *(each for each in (move, soak) if each is not None))

    @property
    def _drives(self) -> bool:
        """Whether a table and a chamber are driven."""
        return any(isinstance(step, Home | MoveChamber) for step in self.steps)

    def mounted_at(self, index: int) -> str | None:
        """Return the position in which the units are before step `index`; None when they have not been turned yet."""
        mounts = [step.position for step in self.steps[:index] if isinstance(step, Mount)]
        return mounts[-1] if mounts else None

    def left_out_with(self, index: int) -> tuple[int, ...]:
        """Return the steps that make no sense without the mounting of step `index`: its temperatures and data sets.

        A switching-on among them goes too where the next mounting switches on anew.
        """
        mount = self.steps[index]
        assert isinstance(mount, Mount)
        of_it = [
            n
            for n, step in enumerate(self.steps)
            if isinstance(step, Acquire | Turn) and step.mounting == mount.mounting
        ]
        end = max(of_it, default=index)
        later = next((step for step in self.steps[end + 1 :] if isinstance(step, PowerOn | Acquire | Turn)), None)
        kinds: tuple[type, ...] = (Acquire, Turn, CheckHome, Soak, MoveChamber, SetSupply, Rest)
        kinds = kinds if isinstance(later, Acquire | Turn) else (*kinds, PowerOn, PowerOff)
        return tuple(n for n in range(index + 1, end + 1) if isinstance(self.steps[n], kinds))

    def run_at(self, index: int, skipped: frozenset[int] = frozenset()) -> int:
        """Return the number of the powered session in force at step `index`; 0 when the units are off."""
        return _powered(tuple(step for n, step in enumerate(self.steps[:index]) if n not in skipped))


def _unset(step: Step) -> set[str]:
    """Return the names that plans of before a later version do not have, where the step does not use them."""
    if isinstance(step, MeasureClock) and not step.runs_s:
        return {"runs_s"}
    if isinstance(step, MoveChamber) and step.wait:
        return {"wait"}
    if not isinstance(step, Acquire):
        return set()
    return {name for name in ("verification", "course") if not getattr(step, name)}


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
    return Plan(recipe=runnable, steps=write_steps(runnable, limits), clipped=clipped)


def _refuse_endless(recipe: Recipe) -> None:
    """Refuse what no bench would ever finish, before it is written down step by step."""
    rates = len(recipe.rates_dps) * (recipe.repeats + 1)
    data_sets = len(recipe.positions) * (len(recipe.temperatures_c) + 1) * rates
    if (indexing := recipe.indexing) is not None:
        mountings = len(recipe.positions) * (len(indexing.unit_deg) + len(indexing.fixture_deg))
        data_sets += mountings * len(indexing.temperatures_c) * len(indexing.rates_dps)
    if recipe.inverted is not None:
        data_sets += len(recipe.positions) * len(recipe.inverted.temperatures_c) * len(recipe.inverted.rates_dps)
    if (supply := recipe.supply) is not None:
        data_sets += recipe.repeats * len(supply.deviations_pct) * len(supply.rates_dps)
    if (other := recipe.another_radius) is not None:
        data_sets += len(recipe.positions) * len(other.temperatures_c) * len(other.rates_dps)
    if recipe.power_cycle is not None:
        data_sets += recipe.power_cycle.count * len(recipe.power_cycle.rates_dps)
    if (ramp := recipe.ramp) is not None:
        each_s = recipe.acquire.duration_s + recipe.acquire.settle_s
        dwells_s = max(ramp.dwell_s, ramp.first_dwell_s or 0.0) * (len(ramp.ends_c) - 1)
        way_s = 60.0 * ramp.way_c / (ramp.c_per_min or 1.0) + dwells_s
        data_sets += math.ceil(len(recipe.positions) * way_s / each_s)
    if (verify := recipe.verification) is not None:
        data_sets += len(verify.positions or recipe.positions) * verify.temperatures * verify.rates
    if recipe.turns is not None:
        data_sets = DATA_SETS_OF_TURN * len(recipe.positions) * len(recipe.turns.turns_deg) * recipe.turns.repeats
    if data_sets > MAX_DATASETS:
        text = f"about {data_sets} data sets, but a campaign may have at most {MAX_DATASETS}"
        raise PlanRefused(recipe.name, [text], "Ask for fewer rates, temperatures or repeats.")
