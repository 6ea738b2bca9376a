"""Waiting for what another thread does: polled whenever it reports that something happened."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

WAIT_S = 60.0  #: for the next event
LOOK_S = 0.002


def wait_until(
    listen: Callable[[Callable[[], None]], Callable[[], None]], look: Callable[[], Any], holds: Callable[[Any], Any]
) -> Any:
    """Return what `look` gives once it `holds`; `listen` calls back at each event and returns how to end that.

    Raises AssertionError when no event comes for WAIT_S.
    """
    happened = threading.Event()
    stop = listen(happened.set)
    try:
        while True:
            happened.clear()
            answer = look()
            if holds(answer):
                return answer
            assert happened.wait(WAIT_S), f"no event in {WAIT_S:g} s: {answer}"
    finally:
        stop()


def eventually(holds: Callable[[], Any]) -> None:
    """Return once a condition on another thread, which reports nothing, holds; AssertionError after WAIT_S."""
    never = threading.Event()
    for _ in range(round(WAIT_S / LOOK_S)):
        if holds():
            return
        never.wait(LOOK_S)
    raise AssertionError(f"not in {WAIT_S:g} s")
