"""Waiting: time that passes in slices, with a look at the requests of people and at the bench in each.

Whatever waits, for a soak, a settled rate, a person or a link, waits here: a request to stop takes effect within
`CHECK_S`, as `Aborted` or `Interrupted`. Ctrl-C at a terminal is a `KeyboardInterrupt` out of the clock's sleep.
"""

from __future__ import annotations

from collections.abc import Iterator

from procedures.contracts.errors import Aborted, Interrupted
from procedures.contracts.journal import CampaignState
from procedures.execution.context import POLL_S, ExecutionContext

CHECK_S = 1.0  #: how long the clock runs at most between two looks at the control


def checkpoint(context: ExecutionContext) -> None:
    """Obey a request to end. Raises Interrupted for a campaign that is to be resumed, else Aborted."""
    request = context.control.poll()
    if request.abort:
        raise Interrupted(request.reason) if request.resumable else Aborted(request.reason)


def pass_time(context: ExecutionContext, duration_s: float, *, pausing: bool = True) -> None:
    """Let the clock run, with a checkpoint at least once a second. Raises Aborted."""
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
    """Let time pass with the environment recorded. Raises what `polls` raises."""
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
