"""A thread that holds the one writing connection of a store."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from labctl.store import Store


@contextmanager
def held_writer(store: Store) -> Iterator[Callable[[], None]]:
    """Give what makes a thread hold the connection, at its first call; it is released at the end."""
    taken, free = threading.Event(), threading.Event()

    def hold() -> None:
        with store.audit._database.writing():
            taken.set()
            free.wait()

    holder = threading.Thread(target=hold, name="the-holder")

    def begin() -> None:
        if not taken.is_set():
            holder.start()
            taken.wait()

    try:
        yield begin
    finally:
        free.set()
        if holder.ident is not None:
            holder.join()
