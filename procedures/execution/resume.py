"""Taking up an interrupted campaign: safe state first, look where everything is, then what must be done again."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import Event
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import Acquire, Soak, Step
from procedures.execution.context import ExecutionContext
from procedures.execution.safe_state import make_safe
from procedures.execution.step_handlers import open_streams
from procedures.planning.plan import Plan
from procedures.recipe.recipe import ResumeRules

#: Between two tries to make the bench safe: instruments may still be starting up after a power cut.
FIRST_PAUSE_S, LONGEST_PAUSE_S = 2.0, 30.0


@dataclass(frozen=True)
class Restart:
    """What is known of the interruption that a campaign is taken up after."""

    gap_s: float = math.inf  #: for how long nobody watched; infinite where a soak was owed already
    power_lost: bool = False  #: the units were off meanwhile
    added_runs: int = 0  #: powered sessions more than the plan has, this one among them
    dropped: Mapping[str, str] = field(default_factory=dict)  #: units that took no further part, and why
    skipped: frozenset[int] = frozenset()  #: steps that were left out before


def soak_matters_after_s(rules: ResumeRules, band_c: float, ramp_c_per_min: float) -> float:
    """Return how long a temperature may go unwatched: until the air can have left its band and come back unseen."""
    if rules.soak_again_after_s is not None:
        return rules.soak_again_after_s
    return 60.0 * 2.0 * band_c / ramp_c_per_min


def take_up(
    stage: ExecutionContext, plan: Plan, start_at: int, restart: Restart, carry_out: Callable[[Step], object]
) -> None:
    """Make the bench what step `start_at` relies on.

    Raises StepFailed when it cannot be made safe first, and what steps raise.
    """
    _safe_first(stage)
    stage.watch.begin()
    left_c = _Furthest(plan, start_at)
    with stage.watch.telling(left_c.add):
        stage.look(read_latest=False)
        if not any(isinstance(step, Acquire) for step in plan.steps[start_at:]):
            return
        if run := plan.run_at(start_at, restart.skipped):
            _switch_on(stage, run + stage.added_runs, restart)
        lead_in = plan.lead_in(start_at)
        for step in lead_in:
            if not isinstance(step, Soak):
                _again(stage, step, start_at, carry_out)
    for step in lead_in:
        if isinstance(step, Soak):
            _soak_if_it_matters(stage, step, start_at, restart, left_c.most, carry_out)
    stage.log.event(Event("lead_in_done", f"ready for step {start_at + 1}"))


def _safe_first(stage: ExecutionContext) -> None:
    """Bring the bench to its safe state, trying again while instruments start up."""
    until_s = stage.clock.now_s() + stage.recipe.resume.instruments_within_s
    pause_s = FIRST_PAUSE_S
    while complaints := make_safe(stage.whole, stage.clock):
        if stage.clock.now_s() >= until_s:
            raise StepFailed("taken up, but the bench could not be made safe first: " + "; ".join(complaints))
        stage.pass_time(pause_s, pausing=False)
        pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
    stage.log.event(Event("safe_state", "the bench is in its safe state before anything else"))


class _Furthest:
    """Hears of every look and keeps how far the air was from the temperature that is to be held."""

    def __init__(self, plan: Plan, start_at: int) -> None:
        self._soak = next((step for step in plan.lead_in(start_at) if isinstance(step, Soak)), None)
        self.most = 0.0

    def add(self, _t_s: float, chamber_c: float, _gyro_c: object) -> None:
        if self._soak is not None:
            self.most = max(self.most, abs(chamber_c - self._soak.temperature_c))


def _switch_on(stage: ExecutionContext, run: int, restart: Restart) -> None:
    """Have the units on, streams open. After a power cut they come back by themselves, or a person is asked."""
    if not restart.power_lost:
        open_streams(stage, run)
        return
    text = f"the power failed: make sure that the units are switched on (session {run})"
    prompt = Prompt(stage.new_prompt_id(), "power_on", text)
    if stage.operator.at_once:
        stage.ask(prompt)
        open_streams(stage, run)
    else:
        try:
            open_streams(stage, run, dropping=False)
        except Exception as error:  # noqa: BLE001  whatever is silent, a person looks at it and then it is tried again
            stage.log.event(Event("units_off", f"{error}", level="warning"))
            stage.ask(prompt)
            open_streams(stage, run)
    stage.log.journal.session_began(run, stage.log.t_s())
    stage.watch_for(stage.recipe.warm_up_s)


def _again(stage: ExecutionContext, step: Step, start_at: int, carry_out: Callable[[Step], object]) -> None:
    stage.log.event(Event("lead_in", f"done again before step {start_at + 1}: {step.kind}"))
    carry_out(step)


def _soak_if_it_matters(
    stage: ExecutionContext,
    soak: Soak,
    start_at: int,
    restart: Restart,
    left_c: float,
    carry_out: Callable[[Step], object],
) -> None:
    limit_s = soak_matters_after_s(stage.recipe.resume, soak.band_c, stage.bench.chamber.limits.ramp_c_per_min)
    if restart.power_lost or restart.gap_s > limit_s or left_c > soak.band_c:
        _again(stage, soak, start_at, carry_out)
        return
    stage.soaked = soak
    text = f"unwatched for {restart.gap_s:.0f} s, the air never further than {left_c:.2f} deg C off: no soak is needed"
    stage.log.event(Event("soak_holds", text, value=restart.gap_s, limit=limit_s, unit="s"))
