"""In whose name something is done: set once where a request comes in, so that every audit row has it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class Actor:
    """Who acts, and how that is known: "key", "command line", "loopback"."""

    name: str
    via: str = ""


#: Actor of what no user requested, such as a campaign's changes of state in its own thread.
ITSELF = Actor("labctl")

_actor: ContextVar[Actor] = ContextVar("actor")


@contextmanager
def acting(who: Actor) -> Iterator[None]:
    """Do everything inside in the name of `who`."""
    token = _actor.set(who)
    try:
        yield
    finally:
        _actor.reset(token)


def actor() -> Actor:
    """Return in whose name this thread or task acts now."""
    return _actor.get(ITSELF)


def acting_key() -> str | None:
    """Return the name of the API key by which this thread or task acts; None where a name is only claimed or typed."""
    who = actor()
    return who.name if who.via == "key" else None
