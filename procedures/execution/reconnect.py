"""Reconnecting to an instrument that fell silent: a bounded number of tries with growing pauses."""

from __future__ import annotations

from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply
from procedures.contracts.journal import Event
from procedures.contracts.steps import Acquire, Home, MeasureClock, MoveChamber, Rest, Soak, Step, Turn
from procedures.execution.context import POLL_S, ExecutionContext, raise_violation
from procedures.execution.waiting import pass_time

PAUSES_S = (1.0, 2.0, 4.0, 8.0, 16.0)
STANDSTILL_S = 60.0
#: Steps that can be begun again without asking a person anew; a turn by hand asks anyway.
REPEATABLE = (Home, MeasureClock, MoveChamber, Soak, Acquire, Turn, Rest)


def is_reconnectable(context: ExecutionContext, step: Step, error: LinkError) -> bool:
    """Return whether a step may be begun again once its instrument answers.

    A table that is silent or sends malformed replies in the middle of a move may have lost steps or time, and a person
    has to inspect it; a table whose port went away and came back is homed.
    """
    if not isinstance(step, REPEATABLE):
        return False
    return error.device != context.bench.table_name or not isinstance(error, NoReply | MalformedReply)


def reconnect(context: ExecutionContext, error: LinkError) -> None:
    """Wait, with the table at rest, until an instrument answers again.

    Raises the error when it stays silent, GuardTripped, and InstrumentError for a table that cannot be stopped.
    """
    device = error.device
    if device != context.bench.table_name:
        context.bench.stop_table()  # an earlier move may still run, and a controller refuses another one meanwhile
    context.monitor.links.change(device, "degraded", f"{error}; trying again at most {len(PAUSES_S)} times")
    for attempt, pause_s in enumerate(PAUSES_S, start=1):
        pass_time(context, pause_s, pausing=False)
        violations = context.without_dropouts(context.monitor.poll(POLL_S))
        # a violation that suspends is found again when the step begins
        raise_violation([each for each in violations if each.action == "fail"])
        try:
            _reach(context, device)
        except InstrumentError as silent:
            text = f"attempt {attempt} of {len(PAUSES_S)} failed: {silent}"
            context.recorder.event(Event("link.retry", text, level="warning", device=device))
            continue
        context.monitor.links.change(device, "well")
        return
    context.monitor.links.change(
        device, "lost", f"{error}; the instrument was not reached again in {len(PAUSES_S)} tries"
    )
    raise error


def _reach(context: ExecutionContext, device: str) -> None:
    bench = context.bench
    if device == bench.table_name:
        bench.table.stop()
        until_s = context.clock.now_s() + STANDSTILL_S
        while bench.table.is_moving() and context.clock.now_s() < until_s:
            pass_time(context, 1.0, pausing=False)
        bench.table.home()
    elif device == bench.chamber_name:
        bench.chamber.read()
    elif device in bench.references:
        bench.references[device].read()
    elif device in bench.gyros:
        bench.gyros[device].stop()
        bench.gyros[device].start()
        bench.gyros[device].read_latest()
