"""The interface that says when a campaign has measured enough. The engine asks; it knows nothing of a fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from procedures.contracts.journal import Event


@dataclass(frozen=True)
class Sufficiency:
    """What the data sets so far say."""

    events: tuple[Event, ...] = ()  #: what is to be recorded, in this order
    enough: str = ""  #: why the campaign has measured enough; empty: it has not, or that is not known yet


class SufficiencyMonitor(Protocol):
    """The one that knows how well the data sets determine what they are measured for. It never raises."""

    def ask(self) -> Sufficiency:
        """Return what is known that was not returned before. On a real bench it returns at once: the table turns."""
        ...

    def conclude(self, enough: str) -> Sufficiency:
        """Return what all data sets say, for the reason of the end, once the bench is in its safe state.

        `enough` is why the campaign has ended early, if it has. `Sufficiency.enough` is the sentence for the reason.
        """
        ...

    def close(self) -> None:
        """Release what it works with."""
        ...
