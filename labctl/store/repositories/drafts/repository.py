"""Drafts: each is due from the start of its campaign on, and made once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import sqlalchemy as sa

from labctl.answers.json_object import JsonObject
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import CAMPAIGN
from labctl.store.paging import parts_of
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables
from labctl.store.sealing.seals import changing
from procedures.contracts.campaign_state import CampaignState

DraftState = Literal["due", "fitted", "made", "failed"]
#: States of a draft that still has to be made.
OPEN: tuple[DraftState, ...] = ("due", "fitted")


@dataclass(frozen=True)
class DraftRow:
    """The draft of one recording."""

    recording: int
    campaign: int
    serial: str
    state: DraftState
    version: int | None
    at: datetime | None
    reason: str
    report: JsonObject | None


@dataclass(frozen=True)
class DraftEvent:
    """What the events of the campaign say of a draft."""

    message: str
    level: Literal["info", "warning"]


class Drafts:
    """The drafts of all campaigns."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of_campaign(self, campaign: int) -> list[DraftRow]:
        """Return the drafts of a campaign, by recording."""
        return self._rows(tables.drafts.c.campaign_id == campaign)

    def of_campaigns(self, campaigns: Sequence[int]) -> Mapping[int, list[DraftRow]]:
        """Return the drafts of several campaigns by their numbers; a campaign without any is left out."""
        drafts: dict[int, list[DraftRow]] = {}
        for row in self._rows(tables.drafts.c.campaign_id.in_(campaigns)):
            drafts.setdefault(row.campaign, []).append(row)
        return drafts

    def newest_of_units(self, serials: Sequence[str]) -> list[DraftRow]:
        """Return the draft that was made, or failed, last for each of some units; one without any is left out."""
        d = tables.drafts.c
        newest = sa.select(sa.func.max(d.recording_id)).where(d.state.not_in(OPEN)).group_by(d.serial)
        parts = (self._rows(d.recording_id.in_(newest.where(d.serial.in_(some)))) for some in parts_of(serials))
        return [row for part in parts for row in part]

    def outstanding(self, bench: str | None = None) -> list[int]:
        """Return the campaigns, of one bench or of all, that are done and whose drafts have to be made; the oldest
        first."""
        d, c = tables.drafts.c, tables.campaigns.c
        query = (
            sa.select(d.campaign_id)
            .join(tables.campaigns, c.id == d.campaign_id)
            .where(d.state.in_(OPEN), c.state == CampaignState.DONE)
            .distinct()
            .order_by(d.campaign_id)
        )
        if bench is not None:
            query = query.where(c.bench_name == bench)
        with self._database.reading() as connection:
            return [int(number) for number in connection.scalars(query)]

    def is_awaited(self, campaign: int) -> bool:
        """Return whether a draft of a campaign still has to be made."""
        d = tables.drafts.c
        query = sa.select(d.recording_id).where(d.campaign_id == campaign, d.state.in_(OPEN)).limit(1)
        with self._database.reading() as connection:
            return connection.scalar(query) is not None

    def dropped(self, recording: int) -> str | None:
        """Return why a unit was excluded from the campaign of a recording; None where it was not."""
        r = tables.recordings.c
        with self._database.reading() as connection:
            return connection.scalar(sa.select(r.dropped).where(r.id == recording))

    def _rows(self, condition: sa.ColumnElement[bool]) -> list[DraftRow]:
        d = tables.drafts.c
        query = sa.select(
            d.recording_id.label("recording"), d.campaign_id.label("campaign"), d.serial, d.state, d.version, d.at,
            d.reason, d.report,
        )  # fmt: skip
        with self._database.reading() as connection:
            return records_of(DraftRow, connection.execute(query.where(condition).order_by(d.recording_id)))

    @transaction
    def conclude(self, recording: int, report: JsonObject, event: DraftEvent, at: datetime) -> bool:
        """Keep the report on a draft that was fitted, with its event; returns whether this was the first."""
        values = {"state": "made", "report": dict(report), "at": at, "reason": ""}
        return self._ended(recording, ("fitted", "failed"), values, event, at)

    @transaction
    def fail(self, recording: int, reason: str, event: DraftEvent, at: datetime) -> bool:
        """Write down why a draft could not be made; returns False for one that was made."""
        values = {"state": "failed", "reason": reason, "at": at}
        return self._ended(recording, ("due", "fitted", "failed"), values, event, at)

    def _ended(
        self, recording: int, states: Sequence[DraftState], values: JsonObject, event: DraftEvent, at: datetime
    ) -> bool:
        d = tables.drafts
        with self._database.writing() as connection:
            changed = sa.update(d).where(d.c.recording_id == recording, d.c.state.in_(states)).values(**values)
            if connection.execute(changed).rowcount != 1:
                return False
            row = connection.execute(sa.select(d).where(d.c.recording_id == recording)).one()
            e, t = tables.events.c, sa.select(sa.func.coalesce(sa.func.max(tables.events.c.t_s), 0.0))
            last_s = float(connection.scalar(t.where(e.campaign_id == row.campaign_id)) or 0.0)
            with changing(connection, [(CAMPAIGN.name, str(row.campaign_id))], at, "draft"):
                connection.execute(
                    sa.insert(tables.events).values(
                        campaign_id=row.campaign_id, at=at, t_s=last_s, kind="draft", level=event.level,
                        message=event.message, device=row.serial[:100],
                    )
                )  # fmt: skip
            detail = {"unit": row.serial, "version": row.version, "state": row.state, "said": event.message}
            append(connection, at, "draft", f"campaign {row.campaign_id}", detail)
        return True
