"""A stop that goes on as a test lets it."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field


@dataclass
class FakeStopping:
    """A stop that goes on as its events say."""

    text: str = "the table is at rest"
    campaign: int | None = 7
    stands: bool = True
    heard: threading.Event = field(default_factory=threading.Event)
    over: threading.Event = field(default_factory=threading.Event)

    def is_heard(self, within_s: float) -> bool:
        return self.heard.wait(within_s)

    def is_over(self, within_s: float) -> bool:
        return self.over.wait(within_s)
