"""What a test leaves running: threads, and asyncio tasks."""

from __future__ import annotations

import asyncio
import threading
from asyncio import runners
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

#: How long a thread that was asked to end may take to do so.
END_S = 10.0
#: Threads of pools that a library keeps for the next call, by the beginning of their name.
POOLS = (
    "AnyIO worker thread",  # of a service that several tests share: ends with its event loop
    "asyncio_",  # of the same loop, for those who look for events: `asyncio.run` waits for it
    "lookup",  # of such a service too: ends when the service is closed
)


@contextmanager
def leftover_threads() -> Iterator[list[str]]:
    """Yield a list that after the block names the threads that were begun in it and did not end."""
    before, found = set(threading.enumerate()), list[str]()
    yield found
    begun = [thread for thread in threading.enumerate() if thread not in before and not thread.name.startswith(POOLS)]
    for thread in begun:
        thread.join(END_S)
    found += [thread.name for thread in begun if thread.is_alive()]


@contextmanager
def leftover_tasks() -> Iterator[list[str]]:
    """Yield a list that after the block names the tasks that were pending when their event loop was closed in it.

    `asyncio.run` cancels those without a word.
    """
    found: list[str] = []
    cancel = runners._cancel_all_tasks

    def noted(loop: asyncio.AbstractEventLoop) -> None:
        found.extend(repr(task.get_coro()) for task in asyncio.all_tasks(loop))
        cancel(loop)

    with patch.object(runners, "_cancel_all_tasks", noted):
        yield found
