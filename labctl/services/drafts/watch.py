"""Watching for campaigns that are done: their drafts are made outside the process that drives the bench.

What is due is in the database, so that nothing is lost when a service ends between the last step and the fit: the next
service on the bench makes it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from instruments.clock import Clock
from labctl.errors import BenchSilent, LabctlError, StoreError, TooBusy
from labctl.log import get_logger
from labctl.services.background import BackgroundWork
from labctl.services.drafts.make import fail_draft
from labctl.store import Store
from procedures.recipe.fit_rules import FitRules

log = get_logger()

#: A computation that ended without a result, for want of memory or time, is tried so often.
TRIES = 3
#: What passes by itself: the draft stays due.
PASSING = (TooBusy, StoreError, BenchSilent)


class DraftWatch:
    """Makes the drafts of the campaigns of one bench, one campaign after the other, in a thread of its own."""

    def __init__(
        self, store: Store, clock: Clock, bench: Callable[[], str | None], make: Callable[[int], object]
    ) -> None:
        """`bench` returns the name of the bench whose campaigns are watched, None for all; `make` makes the drafts of
        a campaign, in another process where there is one."""
        self._store, self._clock, self._bench, self._make = store, clock, bench, make
        self._tries: Counter[int] = Counter()
        self.background = BackgroundWork("drafts", "draft.waits", clock, self.tick)

    def tick(self) -> None:
        """Make the drafts that are due. Raises StoreError where the database cannot be read."""
        for campaign in self._store.drafts.outstanding(self._bench()):
            if self.background.is_over:
                return
            try:
                self._make(campaign)
            except PASSING as error:
                self.background.note(error)
                return
            except Exception as error:  # noqa: BLE001  of whatever kind: tried again, then written down
                if self.background.is_over:  # the computation was ended with the service
                    return
                self._failed(campaign, error)

    def _failed(self, campaign: int, error: Exception) -> None:
        """Try again the next time; after `TRIES` write down that there is no draft."""
        self._tries[campaign] += 1
        log.warning("draft.trouble", campaign=campaign, tries=self._tries[campaign], error=str(error))
        if self._tries[campaign] < TRIES:
            return
        rules = FitRules.model_validate(self._store.campaigns.get(campaign).recipe["fit"])
        reason = str(error) if isinstance(error, LabctlError) else f"{type(error).__name__}: {error}"
        for draft in self._store.drafts.of_campaign(campaign):
            if draft.state in {"due", "fitted"}:
                fail_draft(self._store, draft, rules, reason, self._clock.utc())
