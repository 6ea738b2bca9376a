"""Waiting: time that passes in slices, with a check of requests and of the bench in each.

Every wait, for a soak, a settled rate, a person, a link or limits to hold again, is done here: a request to stop
takes effect within `CHECK_S`, as `Aborted` or `Interrupted`. Ctrl-C at a terminal is a `KeyboardInterrupt` out of the
clock's sleep.
"""

from __future__ import annotations

from collections.abc import Iterator

from instruments.errors import RequestRejected
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import Aborted, GuardTripped, Interrupted, StepFailed
from procedures.contracts.journal import Event
from procedures.execution.context import POLL_S, ExecutionContext
from procedures.recipe.rules import WAITED_FOR

CHECK_S = 1.0  #: how long the clock runs at most between two polls of the control


def checkpoint(context: ExecutionContext) -> None:
    """Check for a request to end. Raises Interrupted for a campaign that is to be resumed, else Aborted."""
    request = context.control.poll()
    if request.abort:
        raise Interrupted(request.reason) if request.resumable else Aborted(request.reason)


def pass_time(context: ExecutionContext, duration_s: float, *, pausing: bool = True) -> None:
    """Wait, with a checkpoint at least once a second. Raises Aborted."""
    until_s = context.clock.now_s() + duration_s
    checkpoint(context)
    while (left_s := until_s - context.clock.now_s()) > 0:
        context.clock.sleep(min(CHECK_S, left_s))
        checkpoint(context)
        if pausing and context.control.request.pause:
            hold(context)


def polls(context: ExecutionContext, *, pausing: bool = True) -> Iterator[None]:
    """Poll the bench now and then every `POLL_S` for as long as the caller iterates.

    Raises Aborted, GuardTripped, InstrumentError.
    """
    while True:
        context.poll()
        yield
        pass_time(context, POLL_S, pausing=pausing)


def record_for(context: ExecutionContext, duration_s: float) -> None:
    """Wait while the environment is recorded. Raises what `polls` raises."""
    until_s = context.clock.now_s() + duration_s
    context.poll()
    while (left_s := until_s - context.clock.now_s()) > 0:
        pass_time(context, min(POLL_S, left_s))
        context.poll()


def hold(context: ExecutionContext) -> None:
    """Stay as things are while a pause is requested; the environment is recorded and guards stay armed."""
    if not context.control.request.pause:
        return
    before, began_s = context.recorder.state, context.clock.now_s()
    context.recorder.change_state(CampaignState.PAUSED, context.control.request.reason)
    next_poll_s = began_s
    with context.monitor.listening(context.notice_leaving):
        while context.control.request.pause:
            if context.clock.now_s() >= next_poll_s:
                context.poll()
                next_poll_s = context.clock.now_s() + POLL_S
            context.clock.sleep(CHECK_S)
            checkpoint(context)
    context.paused_s += context.clock.now_s() - began_s
    context.recorder.change_state(before, context.control.request.reason)


def take_back(context: ExecutionContext) -> None:
    """Restore the chamber's set point after others changed it. Raises StepFailed."""
    if (given_c := context.monitor.given_c) is None:
        return
    chamber = context.bench.chamber
    try:
        chamber.set_temperature_c(given_c)
    except RequestRejected as error:
        raise StepFailed(f"the set point {given_c:g} deg C cannot be taken back: {error}") from error
    context.recorder.event(Event("taken_back", f"{chamber.name}: set point {given_c:g} deg C was given again"))


def suspend(context: ExecutionContext, violation: GuardTripped) -> None:
    """Wait with the table at rest until every limit has held for `release_s`; the soak that held is owed then.

    Raises StepFailed when a limit that fails is passed meanwhile, or after `suspend_timeout_s`.
    """
    rules, clock, recorder = context.recipe.guards, context.clock, context.recorder
    context.owed_soak, context.soaked = context.soaked or context.owed_soak, None
    context.bench.stop_table()
    recorder.event(Event("soak_owed", f"suspended: {violation}"))
    recorder.change_state(CampaignState.PAUSED, f"suspended: {violation}")
    if violation.action == "take_back":
        take_back(context)
    began_s = clear_since_s = clock.now_s()
    while clock.now_s() - clear_since_s < rules.release_s:
        pass_time(context, POLL_S, pausing=False)
        violations = context.without_dropouts(context.monitor.poll(POLL_S))
        if any(each.action == "fail" for each in violations):
            raise StepFailed(f"while suspended: {violations[0].message}")
        if any(each.action in WAITED_FOR for each in violations):
            clear_since_s = clock.now_s()
        if any(each.action == "take_back" for each in violations):
            take_back(context)
        if clock.now_s() - began_s >= rules.suspend_timeout_s:
            raise StepFailed(
                f"suspended for {rules.suspend_timeout_s:g} s, the limit of the recipe, because: "
                f"{violation}; remove the cause, then resume the campaign"
            )
    recorder.change_state(CampaignState.RUNNING, "the limits hold again")
