"""pyHanko runs an event loop of its own inside its functions, which fails where one runs already in the thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def in_own_thread(work: Callable[[], T]) -> T:
    """Return what a function returns in a thread that runs no event loop; raises what it raises."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        return pool.submit(work).result()
