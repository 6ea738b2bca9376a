"""Suspension: what a guard with the action `suspend` leads to. The campaign waits at rest until every limit holds."""

from __future__ import annotations

from procedures.contracts.errors import GuardTripped, StepFailed
from procedures.contracts.journal import CampaignState, Event
from procedures.execution.context import POLL_S, ExecutionContext
from procedures.execution.waiting import pass_time


def suspend(context: ExecutionContext, violation: GuardTripped) -> None:
    """Wait with the table at rest until every limit has held for `release_s`; the soak that held is owed then.

    Raises StepFailed when a limit that fails is passed meanwhile, or after `suspend_timeout_s`.
    """
    rules, clock, recorder = context.recipe.guards, context.clock, context.recorder
    context.owed_soak, context.soaked = context.soaked or context.owed_soak, None
    context.bench.table.stop()
    recorder.event(Event("soak_owed", f"suspended: {violation}"))
    recorder.change_state(CampaignState.PAUSED, f"suspended: {violation}")
    began_s = clear_since_s = clock.now_s()
    while clock.now_s() - clear_since_s < rules.release_s:
        pass_time(context, POLL_S, pausing=False)
        violations = context.without_dropouts(context.monitor.poll(POLL_S))
        if any(each.action == "fail" for each in violations):
            raise StepFailed(f"while suspended: {violations[0].message}")
        if any(each.action == "suspend" for each in violations):
            clear_since_s = clock.now_s()
        if clock.now_s() - began_s >= rules.suspend_timeout_s:
            raise StepFailed(f"suspended for {rules.suspend_timeout_s:g} s without relief: {violation}")
    recorder.change_state(CampaignState.RUNNING, "the limits hold again")
