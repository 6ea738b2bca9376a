"""Recovery of campaigns that a process left unfinished on a bench: resumed by the service, or closed with a reason."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from logging import INFO, WARNING
from typing import Literal

from instruments.bench import open_bench
from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.errors import InstrumentError
from labctl.errors import BenchBusy, DatabaseUnreachable, LabctlError
from labctl.log import get_logger
from labctl.services.campaigns.resumability import retries_exhausted
from labctl.services.campaigns.status import from_rows, how_far
from labctl.store import Store
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.execution.safe_state import make_safe

log = get_logger()

EndState = Literal[CampaignState.FAILED, CampaignState.ABORTED]


def describe_recovery(store: Store, bench: str) -> str:
    """Describe the campaign that a service finds on its bench when it starts, and its fate; empty for none."""
    row = next((row for row in store.campaigns.unfinished() if row.bench_name == bench), None)
    if row is None:
        return ""
    text = how_far(from_rows(store, row))
    if store.benches.unconfirmed(bench):
        return f"{text} and is not resumed: bench {bench} was not confirmed safe, and has not been checked since"
    if why_not := retries_exhausted(store.resume_points.of_campaign(row.id)):
        return f"{text} and is not resumed: {why_not}"
    return f"{text}; labctl sets the safe state and then resumes the campaign"


def secure_bench(store: Store, bench_file: BenchFile, clock: Clock) -> str:
    """Make a bench safe whose campaign is not resumed; returns what cannot be confirmed, which stays on its status."""
    if bench_file.is_simulated:  # it ended with its process
        return ""
    complaints: tuple[str, ...] = ()
    try:
        with closing(open_bench(bench_file, clock)) as bench:
            complaints = make_safe(bench, clock)
    except (InstrumentError, OSError) as error:
        complaints = (*complaints, str(error))
    log.log(WARNING if complaints else INFO, "bench.made_safe", bench=bench_file.name, unconfirmed=list(complaints))
    if complaints:
        store.benches.mark(bench_file.name, "; ".join(complaints), clock.utc())
    return "; ".join(complaints)


@dataclass(frozen=True)
class _UnwrittenEnd:
    """A campaign that ended while the database could not be written: its rows do not show the end yet."""

    campaign: int
    why: str


class CampaignRecovery:
    """The unfinished campaigns of one bench."""

    def __init__(self, store: Store, bench: BenchFile, make_clock: Callable[[], Clock]) -> None:
        self._store, self._bench, self._make_clock = store, bench, make_clock
        self._unfinished = False
        self._unwritten: _UnwrittenEnd | None = None

    @property
    def pending(self) -> bool:
        """Whether a campaign waits to be resumed, or its end to be written."""
        return self._unfinished or self._unwritten is not None

    @property
    def has_unfinished(self) -> bool:
        """Whether a campaign waits to be resumed."""
        return self._unfinished

    def expect_resume(self) -> None:
        """Note that a campaign was interrupted and is to be resumed."""
        self._unfinished = True

    def expect_end(self, campaign: int, why: str, *, to_be_resumed: bool = False) -> None:
        """Note that the end of a campaign could not be written, or that of one `to_be_resumed`, whose bench is safe."""
        if to_be_resumed:
            self._unfinished = True
        else:
            self._unwritten = _UnwrittenEnd(campaign, why)

    def record_end(self) -> None:
        """Write the end of a campaign that could not be written when it came. Raises StoreError."""
        if (unwritten := self._unwritten) is None:
            return
        at = self._make_clock().utc()
        text = (
            f"campaign {unwritten.campaign} ended while the database could not be written; it is not known "
            "whether the bench is safe: inspect the bench"
        )
        self._store.benches.mark(self._bench.name, text, at)
        if self._store.campaigns.get(unwritten.campaign).state not in ENDED:
            self._close(unwritten.campaign, unwritten.why)
        self._unwritten = None

    def resume_newest(
        self,
        resume: Callable[[int], object],
        secure: Callable[[], None],
        runs: Callable[[int], bool] = lambda _: False,
    ) -> None:
        """Resume the newest unfinished campaign; every other one, and one that cannot be resumed, is closed.

        `resume` starts a campaign by its number; `secure` makes the bench safe where that fails, because the last
        process may have left it as it was. A campaign that `runs` here by now, because a person was quicker, was not
        left by another process.
        """
        resumed = None
        for row in self._store.campaigns.unfinished():  # newest first
            if row.bench_name != self._bench.name:
                continue
            if resumed is not None:
                text = (
                    f"not resumed: campaign {resumed} on the same bench is resumed first; when that has ended, run "
                    f"`labctl campaign resume {row.id}`"
                )
                self._close(row.id, text)
                continue
            if runs(row.id):
                resumed = row.id
                continue
            why_not = retries_exhausted(self._store.resume_points.of_campaign(row.id))
            try:
                if why_not is None:
                    resume(row.id)
                    resumed = row.id
                    continue
            except BenchBusy:  # another process was quicker, or the lease was lost just now
                return
            except DatabaseUnreachable:  # it passes: tried again when the schedule is read next
                secure()
                return
            except (LabctlError, InstrumentError) as error:
                why_not = f"not resumed: {error}"
            secure()
            self._close(row.id, why_not)
        self._unfinished = False

    def close_stopped(self, campaign: int | None, why: str) -> None:
        """End what was left unfinished on this bench and was stopped since; None: all of it. Raises StoreError."""
        for row in self._store.campaigns.unfinished():
            if row.bench_name == self._bench.name and campaign in {None, row.id}:
                self._close(row.id, f"aborted: {why}", CampaignState.ABORTED)

    def _close(self, campaign: int, why: str, state: EndState = CampaignState.FAILED) -> None:
        self._store.campaigns.close_unfinished(campaign, why, self._make_clock().utc(), state)
        log.warning("campaign.closed", campaign=campaign, bench=self._bench.name, reason=why)
