"""Waiting for what another thread does: checked when it reports that something happened, ever more rarely."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from typing import Any

from tests.helpers.patience import WAIT_S

QUIET_S = 0.2  #: without an event: time to check
POLL_INTERVAL_S = 0.002  #: between two checks of what reports nothing
ASK_S = 0.05  #: between two requests to another process


def wait_until(
    listen: Callable[[Callable[[], None]], Callable[[], None]], look: Callable[[], Any], holds: Callable[[Any], Any]
) -> Any:
    """Return what `look` gives once it `holds`; `listen` calls back at each event and returns how to end that.

    It checks after one event, then after two more, and so on: a campaign in virtual time reports thousands. Where
    nothing happens for QUIET_S it checks at once. Raises AssertionError when no event comes for WAIT_S.
    """
    events = threading.Semaphore(0)
    stop = listen(events.release)
    try:
        for looks in itertools.count(1):
            answer = look()
            if holds(answer):
                return answer
            assert events.acquire(timeout=WAIT_S), f"no event in {WAIT_S:g} s: {answer}"
            for _ in range(looks):
                if not events.acquire(timeout=QUIET_S):
                    break
        raise AssertionError
    finally:
        stop()


def eventually(holds: Callable[[], Any]) -> None:
    """Return once a condition on another thread, which reports nothing, holds; AssertionError after WAIT_S."""
    never = threading.Event()
    for _ in range(round(WAIT_S / POLL_INTERVAL_S)):
        if holds():
            return
        never.wait(POLL_INTERVAL_S)
    raise AssertionError(f"not in {WAIT_S:g} s")


def before_next_request() -> None:
    """Leave the processor to the process that is asked: it needs it for what is waited for."""
    threading.Event().wait(ASK_S)
