"""Campaigns that no process runs: aborting them, and refusing what only a running one can do."""

from __future__ import annotations

from datetime import datetime

from labctl.answers.campaigns import CampaignResponse
from labctl.errors import Conflict
from labctl.log import get_logger
from labctl.services.benches.driving_process import driven_benches, whereabouts
from labctl.services.benches.lease import described, driver_of
from labctl.services.benches.stops import BenchStops
from labctl.services.campaigns.status import campaign_status, outlives_its_process
from labctl.store import Store
from procedures.contracts.campaign_state import ENDED, UNDER_WAY, CampaignState

log = get_logger()


def record_action(store: Store, at: datetime, action: str, campaign: int, reason: str) -> None:
    """Write into the audit trail what a person did to a campaign."""
    store.audit.record(at, f"campaign {action}", f"campaign {campaign}", {"reason": reason})


def abort_abandoned(
    store: Store, campaign: int, reason: str, at: datetime, stops: BenchStops | None = None
) -> CampaignResponse:
    """Close a campaign that no process runs any more. Raises NotFound, and Conflict for one that has ended.

    `stops` are those of the bench, where this process has them: a stop that the latch has is recorded once.
    """
    answer = campaign_status(store, campaign)
    if answer.state in ENDED:
        raise Conflict(
            f"campaign {campaign} has already ended ({answer.state}); start a new one, or resume it if it failed"
        )
    if not store.is_sole_writer and (driver := driver_of(store, answer.bench, at)) is not None:
        raise Conflict(
            f"campaign {campaign} may still be running: {described(driver)}. Nothing was changed; "
            "abort the campaign at that process"
        )
    row = store.campaigns.get(campaign)
    of_bench = BenchStops(store, row.bench_name)
    stops = stops if stops is not None and stops.place == of_bench.place else of_bench
    open_stops = [stop for stop in stops.state.open if stop.campaign == campaign]
    for stop in open_stops:
        stops.record(stop, at)
    if not open_stops:
        record_action(store, at, "abort", campaign, reason)
    sentence = f"left unfinished; {reason}"
    if row.state in UNDER_WAY and outlives_its_process(row):
        text = f"the process that ran campaign {campaign} ended before it could make the bench safe"
        store.benches.mark(row.bench_name, text, at)
        sentence += f". Bench {row.bench_name} has not been made safe: check it, then run `labctl bench clear`"
    store.campaigns.close_unfinished(campaign, sentence, at, CampaignState.ABORTED)
    stops.note_closed(campaign, sentence)
    log.warning("campaign.closed", campaign=campaign, bench=row.bench_name, reason=sentence)
    return campaign_status(store, campaign)


def not_on_bench(store: Store, campaign: int, bench: str) -> Conflict:
    """Return the refusal of an act on a campaign that does not run on this process's bench. Raises NotFound."""
    row = store.campaigns.get(campaign)
    elsewhere = store.is_shared and row.bench_name != bench and row.state not in ENDED
    advice = whereabouts(store, row.bench_name) if elsewhere else "check the number of the campaign"
    return Conflict(f"campaign {campaign} does not run on bench {bench} now (its state: {row.state}); {advice}")


def not_running(store: Store, campaign: int, action: str) -> Conflict:
    """Return the refusal of an action that only a running campaign can take. Raises NotFound."""
    row = store.campaigns.get(campaign)
    if store.is_shared and row.state not in ENDED and row.bench_name in driven_benches(store):
        advice = whereabouts(store, row.bench_name)
        return Conflict(f"campaign {campaign} does not run in this process; {advice}")
    return Conflict(
        f"campaign {campaign} is {row.state} and no process runs it, so it is not possible to {action}; "
        f"`labctl campaign resume {campaign}` continues it"
    )
