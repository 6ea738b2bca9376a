"""What the records of a thread or task have in common: the request that they belong to, and the campaign."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from random import Random

from structlog.contextvars import bind_contextvars, bound_contextvars, clear_contextvars, get_contextvars

#: A number that a client gives its request is taken over if it is one word.
_GIVEN = re.compile(r"[A-Za-z0-9._-]{1,64}")
#: Numbers of requests: they name, and keep no secret, so the system is asked for randomness once for each process.
_numbers = Random()  # noqa: S311
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_numbers.seed)


def new_request_id(requested: str = "") -> str:
    """Return the number of a request: the one that it came with, else a new one."""
    return requested if _GIVEN.fullmatch(requested) else f"{_numbers.getrandbits(64):016x}"


def request_id() -> str:
    """Return the request that this thread or task works for; empty for none."""
    return str(get_contextvars().get("request_id", ""))


def begin_request(number: str) -> None:
    """Bind the log context of this task to a request, until the task ends."""
    clear_contextvars()
    bind_contextvars(request_id=number)


@contextmanager
def for_request(number: str) -> Iterator[None]:
    """Work for a request of another process while the block runs; for none where the number is empty."""
    if not number:
        yield
        return
    with bound_contextvars(request_id=number):
        yield


@contextmanager
def for_campaign(campaign: int, bench: str) -> Iterator[None]:
    """Add a campaign and its bench to every log record of this thread while the block runs."""
    with bound_contextvars(campaign=campaign, bench=bench):
        yield
