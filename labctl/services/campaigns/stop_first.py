"""The stop of a campaign by a command: first the bench, by whatever still lives, then what is to be written down."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress

from labctl.acting_user import actor
from labctl.config import default_database
from labctl.errors import LabctlError
from labctl.services.campaigns.status import outlives_its_process
from labctl.stop.client import NOT_STOPPED, SWITCH, StopResult, at_instruments, stop_bench
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, DriverNote, place_of, places_of
from labctl.store import CampaignRow, open_store
from procedures.contracts.campaign_state import ENDED, UNDER_WAY

#: A database that does not answer within this keeps no stop waiting, s.
DATABASE_S = 1.0


def stop_first(database: str | None, campaign: int, reason: str, say: Callable[[str], None]) -> StopResult | None:
    """Stop the bench of a campaign, if the campaign may be running; None where it is not.

    `say` gets a line where the bench is not known to stand, at once and at the end. Raises nothing.
    """
    location = database or default_database()
    known, row = _row(location, campaign)
    if known and (row is None or row.state in ENDED):
        return None
    stop = StopRequest.new(actor().name, actor().via, reason, campaign)
    results = [
        result
        for place in ([place_of(location, row.bench_name)] if row is not None else places_of(location))
        if (result := _stopped(place, stop, row, say)) is not None
    ]
    if not results:
        return None
    worst = min(results, key=lambda result: result.stands)
    if not worst.stands:
        say(f"{NOT_STOPPED}: bench {worst.bench}: {worst.text}. {SWITCH}.")
    return worst


def _stopped(
    place: BenchPlace, stop: StopRequest, row: CampaignRow | None, say: Callable[[str], None]
) -> StopResult | None:
    """Stop one bench, where a process drives it, or one has ended without leaving it safe."""
    note = place.note()
    if note is not None and (note.driver.lives or note.guardian.lives):
        return stop_bench(place, stop, say)
    if row is None or row.state not in UNDER_WAY or not outlives_its_process(row):
        return None
    if note is not None:
        return stop_bench(place, stop, say)
    with suppress(OSError):
        place.latch.request(stop)
    return at_instruments(DriverNote(row.bench_name, document=dict(row.bench)), say)


def _row(location: str, campaign: int) -> tuple[bool, CampaignRow | None]:
    """Return whether the database has answered in time, and the campaign, where it knows it."""
    rows: list[CampaignRow | None] = []

    def read() -> None:
        with suppress(LabctlError), open_store(location, write=False) as store:
            rows.append(next(iter(store.campaigns.some([campaign])), None))

    thread = threading.Thread(target=read, name="campaign-row", daemon=True)
    thread.start()
    thread.join(DATABASE_S)
    return bool(rows), rows[0] if rows else None
