"""Reaching an instrument again whose wire fell silent: bounded tries with growing pauses, then it is lost."""

from __future__ import annotations

from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply
from procedures.contracts.steps import Acquire, Home, MoveChamber, Rest, Soak, Step
from procedures.execution.context import LOOK_S, ExecutionContext, raise_violation

PAUSES_S = (1.0, 2.0, 4.0, 8.0, 16.0)
STANDSTILL_S = 60.0
#: Steps that can be begun again without asking a person anew.
REPEATABLE = (Home, MoveChamber, Soak, Acquire, Rest)


def is_reconnectable(stage: ExecutionContext, step: Step, error: LinkError) -> bool:
    """Return whether a step may be begun again once its instrument answers.

    A table that is silent or talks nonsense in the middle of a move may have lost steps or time, and a person has to
    look at it; a table whose port went away and came back is homed.
    """
    if not isinstance(step, REPEATABLE):
        return False
    return error.device != stage.bench.table.name or not isinstance(error, NoReply | MalformedReply)


def reconnect(stage: ExecutionContext, error: LinkError) -> None:
    """Wait until an instrument answers again. Raises the error when it stays silent, and GuardTripped."""
    device = error.device
    stage.watch.link(device, "degraded", f"{error}; it is tried again, {len(PAUSES_S)} times")
    for pause_s in PAUSES_S:
        stage.pass_time(pause_s, pausing=False)
        trips = stage.without_dropouts(stage.watch.look(LOOK_S))
        raise_violation(
            [trip for trip in trips if trip.action == "fail"]
        )  # what suspends is seen again when the step begins
        try:
            _reach(stage, device)
        except InstrumentError:
            continue
        stage.watch.link(device, "well")
        return
    stage.watch.link(device, "lost", f"{error}; not reached again in {len(PAUSES_S)} tries")
    raise error


def _reach(stage: ExecutionContext, device: str) -> None:
    bench = stage.bench
    if device == bench.table.name:
        bench.table.stop()
        until_s = stage.clock.now_s() + STANDSTILL_S
        while bench.table.is_moving() and stage.clock.now_s() < until_s:
            stage.pass_time(1.0, pausing=False)
        bench.table.home()
    elif device == bench.chamber.name:
        bench.chamber.read()
    elif device in bench.gyros:
        bench.gyros[device].stop()
        bench.gyros[device].start()
        bench.gyros[device].read_latest()
