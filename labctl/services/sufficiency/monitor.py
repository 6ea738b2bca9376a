"""What the engine asks whether a campaign has measured enough: U of its fit, computed where it delays nothing.

On a simulated bench, whose time stands still meanwhile, the engine's own thread computes it, so that a campaign ends
after the same data set each time. On a real bench another process does, and the engine takes what is known by then.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from labctl.log import get_logger
from labctl.services.sufficiency.evaluation import Evaluation, UnitU
from labctl.services.sufficiency.texts import event_of, missing_text, reached_text
from labctl.store import Store
from procedures.contracts.journal import Event
from procedures.contracts.sufficiency import Sufficiency

log = get_logger()

NOT_COMPUTED = "uncertainty_not_computed"


class Source(Protocol):
    """The one that evaluates a campaign."""

    def newest(self) -> Sequence[UnitU]:
        """Return what is known now of each unit, where it was not returned before."""
        ...

    def last(self) -> Sequence[UnitU]:
        """Return what all data sets say of each unit."""
        ...

    def close(self) -> None:
        """End what it has begun."""
        ...


def _says_the_same(earlier: UnitU | None, now: UnitU) -> bool:
    if earlier is None or earlier.known != now.known:
        return False
    if now.u_dps is None:
        return earlier.why == now.why
    return (earlier.datasets, earlier.u_dps) == (now.datasets, now.u_dps)


class InThisThread:
    """Evaluates a campaign when it is asked to."""

    def __init__(self, store: Store, campaign: int) -> None:
        self._evaluation = Evaluation(store, campaign)

    def newest(self) -> Sequence[UnitU]:
        return self._evaluation.evaluate()

    def last(self) -> Sequence[UnitU]:
        return self._evaluation.evaluate(is_last=True)

    def close(self) -> None: ...


class UncertaintyMonitor:
    """Compares U of a campaign with the target of its recipe. Where that fails, the campaign goes on to its end."""

    def __init__(self, source: Source, planned: int, limit_dps: float) -> None:
        """`planned` is the number of data sets in the plan that are fitted."""
        self._source, self._planned, self._limit_dps = source, planned, limit_dps
        self._told: dict[str, UnitU] = {}  #: the last that was recorded of each unit
        self._failure = ""

    def ask(self) -> Sufficiency:
        """Return the newest U of each unit as events, and whether all of them have reached the target."""
        try:
            units = self._source.newest()
        except Exception as error:  # noqa: BLE001  a campaign does not fail because its end is not known
            return Sufficiency(self._failed(error))
        return Sufficiency(self._events(units), reached_text(units, self._planned, self._limit_dps))

    def conclude(self, enough: str) -> Sufficiency:
        """Return U by all data sets, as events and as a sentence that says whether the target is reached."""
        try:
            units = self._source.last()
        except Exception as error:  # noqa: BLE001  as above
            return Sufficiency(self._failed(error), enough)
        reached = reached_text(units, self._planned, self._limit_dps)
        missing = missing_text(units, self._limit_dps)
        # the data sets that were taken while the reason was being computed count here, too
        sentence = reached or "; with all data sets that were taken, ".join(filter(None, (enough, missing)))
        return Sufficiency(self._events(units), sentence)

    def close(self) -> None:
        """Release what computes."""
        self._source.close()

    def _events(self, units: Sequence[UnitU]) -> tuple[Event, ...]:
        """Return the events of what is new: U that is not known is said again only for another reason."""
        told = [unit for unit in units if not _says_the_same(self._told.get(unit.gyro), unit)]
        self._told.update({unit.gyro: unit for unit in told})
        return tuple(event_of(unit, self._planned, self._limit_dps) for unit in told)

    def _failed(self, error: Exception) -> tuple[Event, ...]:
        """Return the event of a failure, the first time that it occurs."""
        text = f"{type(error).__name__}: {error}"
        if text == self._failure:
            return ()
        self._failure = text
        log.warning("uncertainty.not_computed", error=text)
        told = f"U is not computed ({text}); the campaign goes on with its plan"
        return (Event(NOT_COMPUTED, told, level="warning"),)
