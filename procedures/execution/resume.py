"""Resuming an interrupted campaign: safe state first, then a poll of the bench, then what must be done again."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from procedures.contracts.errors import StepFailed
from procedures.contracts.journal import ClockRun, Event
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import Acquire, Soak, Step, Turn
from procedures.execution.context import ExecutionContext
from procedures.execution.prompting import ask
from procedures.execution.safe_state import make_safe
from procedures.execution.step_handlers import open_streams
from procedures.execution.waiting import pass_time, record_for
from procedures.planning.plan import Plan
from procedures.recipe.rules import ResumeRules

#: Between two tries to make the bench safe: instruments may still be starting up after a power cut.
FIRST_PAUSE_S, LONGEST_PAUSE_S = 2.0, 30.0


@dataclass(frozen=True)
class Restart:
    """What is known of the interruption before a campaign is resumed."""

    gap_s: float = math.inf  #: for how long nothing was recorded; infinite where a soak was owed already
    power_lost: bool = False  #: the units were off meanwhile
    added_runs: int = 0  #: powered sessions more than the plan has, this one among them
    dropped: Mapping[str, str] = field(default_factory=dict)  #: units that were excluded, and why
    skipped: frozenset[int] = frozenset()  #: steps that were left out before
    clock_runs: tuple[ClockRun, ...] = ()  #: that timed the step clock before


def soak_matters_after_s(rules: ResumeRules, band_c: float, ramp_c_per_min: float) -> float:
    """Return how long a temperature may go unwatched: until the air can have left its band and come back unseen."""
    if rules.soak_again_after_s is not None:
        return rules.soak_again_after_s
    return 60.0 * 2.0 * band_c / ramp_c_per_min


def resume_campaign(
    context: ExecutionContext, plan: Plan, start_at: int, restart: Restart, carry_out: Callable[[Step], object]
) -> None:
    """Make the bench what step `start_at` relies on.

    Raises StepFailed when it cannot be made safe first, and what steps raise.
    """
    _make_safe_first(context)
    context.monitor.begin()
    deviation = _ChamberDeviation(plan, start_at)
    with context.monitor.listening(deviation.add):
        context.poll(read_latest=False)
        if not any(isinstance(step, Acquire | Turn) for step in plan.steps[start_at:]):
            return
        if run := plan.run_at(start_at, restart.skipped):
            _switch_on(context, run + context.added_runs, restart)
        lead_in = plan.lead_in(start_at)
        for step in lead_in:
            if not isinstance(step, Soak):
                _repeat(context, step, start_at, carry_out)
    for step in lead_in:
        if isinstance(step, Soak):
            _soak_unless_held(context, step, start_at, restart, deviation.max_c, carry_out)
    context.recorder.event(Event("lead_in_done", f"ready for step {start_at + 1}"))


def _make_safe_first(context: ExecutionContext) -> None:
    """Bring the bench to its safe state, trying again while instruments start up."""
    until_s = context.clock.now_s() + context.recipe.resume.instruments_within_s
    pause_s = FIRST_PAUSE_S
    while complaints := make_safe(context.full_bench, context.clock):
        if context.clock.now_s() >= until_s:
            raise StepFailed("resumed, but the bench could not be made safe first: " + "; ".join(complaints))
        pass_time(context, pause_s, pausing=False)
        pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
    context.recorder.event(Event("safe_state", "setting the bench to its safe state before resuming"))


class _ChamberDeviation:
    """The largest deviation of the air from the temperature that is to be held, over the polls so far, in deg C.

    Infinite while no poll had an answer: what was not measured is not known to hold.
    """

    def __init__(self, plan: Plan, start_at: int) -> None:
        self._soak = next((step for step in plan.lead_in(start_at) if isinstance(step, Soak)), None)
        self.max_c = math.inf

    def add(self, _t_s: float, chamber_c: float, _gyro_c: object) -> None:
        if self._soak is not None:
            deviation_c = abs(chamber_c - self._soak.temperature_c)
            self.max_c = deviation_c if math.isinf(self.max_c) else max(self.max_c, deviation_c)


def _switch_on(context: ExecutionContext, run: int, restart: Restart) -> None:
    """Ensure that the units are on, streams open. After a power cut they come back alone, or a person is asked."""
    context.bench.power_units()  # the safe state switches nothing on
    if not restart.power_lost:
        open_streams(context, run)
        return
    text = f"the power failed: make sure that the units are switched on (session {run})"
    prompt = Prompt(context.new_prompt_id(), "power_on", text)
    if context.operator.at_once:
        ask(context, prompt)
        open_streams(context, run)
    else:
        try:
            open_streams(context, run, dropping=False)
        except Exception as error:  # noqa: BLE001  a silent device is inspected by a person, then tried again
            context.recorder.event(Event("units_off", f"{error}", level="warning"))
            ask(context, prompt)
            open_streams(context, run)
    context.recorder.journal.session_began(run, context.recorder.t_s())
    record_for(context, context.recipe.warm_up_s)


def _repeat(context: ExecutionContext, step: Step, start_at: int, carry_out: Callable[[Step], object]) -> None:
    context.recorder.event(Event("lead_in", f"step repeated before step {start_at + 1}: {step.kind}"))
    carry_out(step)


def _soak_unless_held(
    context: ExecutionContext,
    soak: Soak,
    start_at: int,
    restart: Restart,
    deviation_c: float,
    carry_out: Callable[[Step], object],
) -> None:
    limit_s = soak_matters_after_s(context.recipe.resume, soak.band_c, context.bench.chamber.limits.ramp_c_per_min)
    if restart.power_lost or restart.gap_s > limit_s or deviation_c > soak.band_c:
        _repeat(context, soak, start_at, carry_out)
        return
    context.soaked = soak
    gap = f"without supervision for {restart.gap_s:.0f} s"
    text = f"{gap}; the air was never more than {deviation_c:.2f} deg C from the set point: no soak is needed"
    context.recorder.event(Event("soak_holds", text, value=restart.gap_s, limit=limit_s, unit="s"))
