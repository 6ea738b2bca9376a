"""Listeners of a bench: called by the thread that drives it whenever something has changed."""

from __future__ import annotations

import contextlib
from collections.abc import Callable


class ChangeListeners:
    """Callbacks without arguments. They may not block."""

    def __init__(self) -> None:
        self._listeners: list[Callable[[], None]] = []

    def __contains__(self, listener: object) -> bool:
        return listener in self._listeners

    def add(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends that."""
        self._listeners.append(listener)

        def remove() -> None:
            with contextlib.suppress(ValueError):
                self._listeners.remove(listener)

        return remove

    def notify(self) -> None:
        """Call every listener; one whose event loop has ended is removed."""
        for listener in tuple(self._listeners):
            try:
                listener()
            except RuntimeError:
                with contextlib.suppress(ValueError):
                    self._listeners.remove(listener)
