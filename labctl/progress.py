"""Progress of a long computation: its stages are reported to those who wait for it, and there it can be cancelled."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

#: Takes in a stage of a computation, in words; raises Cancelled where the result is not wanted any more.
Progress = Callable[[str], None]


class Cancelled(Exception):
    """The computation was cancelled: its result is not wanted any more.

    Not a LabctlError: what handles a failed part of a computation must not take it for one.
    """


def _ignore(_stage: str) -> None:
    """Take in a stage that is not shown anywhere."""


_progress: ContextVar[Progress] = ContextVar("progress", default=_ignore)


@contextmanager
def reporting_to(progress: Progress) -> Iterator[None]:
    """Report every stage inside to `progress`; what it raises ends the computation at that stage."""
    token = _progress.set(progress)
    try:
        yield
    finally:
        _progress.reset(token)


def progress() -> Progress:
    """Return where the stages of this thread or task are reported to."""
    return _progress.get()


def report_stage(stage: str) -> None:
    """Report the stage that begins now. Raises Cancelled where the result is not wanted any more."""
    _progress.get()(stage)
