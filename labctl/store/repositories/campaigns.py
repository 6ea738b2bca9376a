"""Campaigns: the plan as rows, written down before the first move, and what became of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Literal

import sqlalchemy as sa

from labctl.answers.json_object import JsonDocument, JsonObject
from labctl.answers.steps import StepJson
from labctl.errors import NotFound
from labctl.recording import RecordingInfo
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.paging import Page, PageRequest, newest_rows, parts_of
from labctl.store.records import CampaignRow, DoneStepRow, EventRow, NewUnit, StepRow
from labctl.store.repositories.audit import append
from labctl.store.repositories.campaign_journal import StoreJournal
from labctl.store.repositories.campaign_summaries import CampaignSummaries, CampaignSummary
from labctl.store.repositories.drafts.transitions import make_due
from labctl.store.repositories.imports import new_recording
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables
from labctl.store.sealing.seals import changing, of_campaign, prepared_recordings
from procedures.contracts.campaign_state import UNFINISHED, CampaignState

#: Kind of the event that says who confirmed that the bench is clear.
BENCH_CLEAR = "operator.bench_clear"


@dataclass(frozen=True)
class NewCampaign:
    """What a campaign starts from."""

    recipe_name: str
    recipe: JsonObject
    bench_name: str
    bench: JsonObject
    schedule_hash: str
    expected_s: float
    steps: Sequence[StepJson]  #: JSON of every step, in order; `kind` and `expected_s` among the keys
    units: Sequence[NewUnit]
    boot_id: str | None = None  #: of the host that runs it
    bench_clear: str = ""  #: what a person has confirmed about the bench before the start, and who


class Campaigns:
    """Runs of recipes on benches."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._summaries = CampaignSummaries(database)

    def summaries(self, campaigns: Sequence[int]) -> dict[int, CampaignSummary]:
        """Return how far each campaign is, by its number."""
        return self._summaries.of(campaigns)

    @transaction
    def create(self, new: NewCampaign, at: datetime) -> int:
        """Write down a whole campaign before anything moves; returns its number."""
        with self._database.writing() as connection:
            self._remember_bench(connection, new, at)
            row = sa.insert(tables.campaigns).values(
                recipe_name=new.recipe_name,
                recipe=dict(new.recipe),
                bench_name=new.bench_name,
                bench=dict(new.bench),
                schedule_hash=new.schedule_hash,
                expected_s=new.expected_s,
                state="planned",
                reason="",
                created_at=at,
                boot_id=new.boot_id,
            )
            number = int(connection.scalar(row.returning(tables.campaigns.c.id)) or 0)
            connection.execute(
                sa.insert(tables.steps),
                [
                    {
                        "campaign_id": number,
                        "number": index,
                        "kind": step["kind"],
                        "body": dict(step),
                        "expected_s": step["expected_s"],
                        "state": "planned",
                    }
                    for index, step in enumerate(new.steps)
                ],
            )
            recording_ids: dict[int, str] = {}
            for unit in new.units:
                info = RecordingInfo.model_validate(unit.info)
                key = new_recording(connection, info, at, campaign=number, gyro=unit.gyro, channels=unit.channels)
                recording_ids[key] = info.serial
            if new.recipe.get("fit") is not None:
                make_due(connection, number, recording_ids)
            if new.bench_clear:
                _confirmed(connection, number, new.bench_clear, at)
            append(connection, at, "campaign start", f"campaign {number}", _audited(new))
        return number

    @staticmethod
    def _remember_bench(connection: sa.Connection, new: NewCampaign, at: datetime) -> None:
        b = tables.benches
        values = {"file": dict(new.bench), "last_used_at": at}
        changed = connection.execute(sa.update(b).where(b.c.name == new.bench_name).values(**values))
        if changed.rowcount == 0:
            connection.execute(sa.insert(b).values(name=new.bench_name, **values))

    def journal(self, campaign: int) -> StoreJournal:
        """Return the journal that a run of this campaign is written to."""
        return StoreJournal(self._database, campaign)

    def get(self, campaign: int) -> CampaignRow:
        """Return one campaign; raises NotFound."""
        rows = self._rows(tables.campaigns.c.id == campaign)
        if not rows:
            raise NotFound(f"campaign {campaign} is not in this database; `labctl campaign list` shows the campaigns")
        return rows[0]

    def newest(self) -> CampaignRow:
        """Return the campaign made last; raises NotFound when there is none."""
        rows = self._rows(tables.campaigns.c.id == sa.select(sa.func.max(tables.campaigns.c.id)).scalar_subquery())
        if not rows:
            raise NotFound("there is no campaign in this database yet; `labctl campaign start RECIPE` starts one")
        return rows[0]

    def newest_of_unit(self, serial: str) -> CampaignRow | None:
        """Return the campaign in which a unit was measured last; None for none."""
        r = tables.recordings.c
        of_unit = sa.select(sa.func.max(r.campaign_id)).where(r.serial == serial).scalar_subquery()
        return next(iter(self._rows(tables.campaigns.c.id == of_unit)), None)

    def newest_on_bench(self, bench: str) -> CampaignRow | None:
        """Return the campaign made last on a bench; None for none."""
        c = tables.campaigns.c
        on_bench = sa.select(sa.func.max(c.id)).where(c.bench_name == bench).scalar_subquery()
        return next(iter(self._rows(c.id == on_bench)), None)

    def last_on_bench(self, bench: str) -> datetime | None:
        """Return the last moment at which a campaign is known to have been on a bench; None where none began.

        By its last event, step or reading of the environment: the end of a campaign that its process left unfinished is
        written later.
        """
        if (newest := self.newest_on_bench(bench)) is None or newest.started_at is None:
            return None
        e, s, v = tables.events.c, tables.steps.c, tables.environment.c
        queries = (
            sa.select(sa.func.max(e.at, type_=e.at.type)).where(e.campaign_id == newest.id),
            sa.select(sa.func.max(s.started_at, type_=s.started_at.type)).where(s.campaign_id == newest.id),
            sa.select(sa.func.max(s.ended_at, type_=s.ended_at.type)).where(s.campaign_id == newest.id),
        )
        last_s = sa.select(sa.func.max(v.t_s)).where(v.recording_id.in_(newest.recordings.values()))
        with self._database.reading() as connection:
            times = [at for query in queries if (at := connection.scalar(query)) is not None]
            read_s = connection.scalar(last_s)
        return max([newest.started_at, *times, newest.started_at + timedelta(seconds=float(read_s or 0.0))])

    def all(self) -> list[CampaignRow]:
        """Return every campaign, newest first."""
        return self._rows(sa.true())

    def page(self, request: PageRequest[int]) -> Page[CampaignRow, int]:
        """Return campaigns, newest first; searched are recipe, bench, state and the units' serial numbers."""
        c, r = tables.campaigns.c, tables.recordings.c
        state = sa.cast(c.state, sa.String)
        of_unit = sa.select(r.campaign_id).where(request.matching((r.serial,)))
        matching = request.matching((c.recipe_name, c.bench_name, state)) | (
            c.id.in_(of_unit) if request.search else sa.false()
        )
        with self._database.reading() as connection:
            of_page, total = newest_rows(connection, c.id, matching, request)
        return Page.of(self._rows(of_page), lambda row: row.id, request, total)

    def some(self, campaigns: Sequence[int]) -> list[CampaignRow]:
        """Return campaigns by their numbers; those that are not there are left out."""
        return [row for some in parts_of(campaigns) for row in self._rows(tables.campaigns.c.id.in_(some))]

    def first_after(self, campaign: int, bench: str) -> int | None:
        """Return the number of the first campaign on a bench that is newer than another campaign; None for none."""
        c = tables.campaigns.c
        with self._database.reading() as connection:
            return connection.scalar(sa.select(sa.func.min(c.id)).where(c.id > campaign, c.bench_name == bench))

    def benches(self, campaigns: Sequence[int]) -> dict[int, JsonDocument]:
        """Return the bench file of each of some campaigns."""
        c = tables.campaigns.c
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(c.id, c.bench).where(c.id.in_(campaigns)))
            return {row.id: row.bench for row in rows}

    def not_ended(self, campaigns: Sequence[int]) -> set[int]:
        """Return which of some campaigns have not ended: more may come of them."""
        c = tables.campaigns.c
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(c.id).where(c.id.in_(campaigns), c.state.in_(UNFINISHED)))
            return {row.id for row in rows}

    def _rows(self, condition: sa.ColumnElement[bool]) -> list[CampaignRow]:
        c, r = tables.campaigns.c, tables.recordings.c
        query = sa.select(
            c.id, c.recipe_name, c.recipe, c.bench_name, c.bench, c.schedule_hash, c.expected_s, c.state, c.reason,
            c.created_at, c.started_at, c.ended_at,
        )  # fmt: skip
        with self._database.reading() as connection:
            rows = [dict(row) for row in connection.execute(query.where(condition).order_by(c.id.desc())).mappings()]
            chosen = sa.select(c.id).where(condition)
            recording_rows = connection.execute(
                sa.select(r.campaign_id, r.serial, r.id).where(r.campaign_id.in_(chosen))
            ).all()
        recordings: dict[int, dict[str, int]] = {}
        for campaign, serial, recording in recording_rows:
            recordings.setdefault(campaign, {})[serial] = recording
        return [CampaignRow(**row, recordings=recordings.get(row["id"], {})) for row in rows]

    def state(self, campaign: int) -> CampaignState:
        """Return the state of one campaign; raises NotFound."""
        with self._database.reading() as connection:
            stored_state = connection.scalar(
                sa.select(tables.campaigns.c.state).where(tables.campaigns.c.id == campaign)
            )
        if stored_state is None:
            raise NotFound(f"campaign {campaign} is not in this database; `labctl campaign list` shows the campaigns")
        return stored_state

    def count_by_state(self) -> dict[str, int]:
        """Return how many campaigns there are in each state that has any."""
        state = tables.campaigns.c.state
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(state, sa.func.count()).group_by(state))
            return {str(name): int(count) for name, count in rows}

    def steps(self, campaign: int) -> list[StepRow]:
        """Return the whole plan with the outcome of each step."""
        s = tables.steps.c
        query = (
            sa.select(s.number, s.kind, s.body, s.expected_s, s.state, s.started_s, s.ended_s, s.result)
            .where(s.campaign_id == campaign)
            .order_by(s.number)
        )
        with self._database.reading() as connection:
            return records_of(StepRow, connection.execute(query))

    def done_steps(self, bench: str, kinds: Sequence[str], campaigns: int) -> list[DoneStepRow]:
        """Return the steps of some kinds that were done in the newest `campaigns` of a bench, oldest first."""
        c, s = tables.campaigns.c, tables.steps.c
        newest = sa.select(c.id).where(c.bench_name == bench).order_by(c.id.desc()).limit(campaigns)
        query = (
            sa.select(s.campaign_id.label("campaign"), c.bench, s.body, (s.ended_s - s.started_s).label("took_s"))
            .join(tables.campaigns, c.id == s.campaign_id)
            .where(s.campaign_id.in_(newest.scalar_subquery()), s.kind.in_(kinds), s.state == "done")
            .where(s.started_s.is_not(None), s.ended_s.is_not(None))
            .order_by(s.campaign_id, s.number)
        )
        with self._database.reading() as connection:
            return records_of(DoneStepRow, connection.execute(query))

    def events(self, campaign: int, after: int = 0, limit: int = 1000, *, kinds: Sequence[str] = ()) -> list[EventRow]:
        """Return events in order, those with a number above `after`; with `kinds` those of these kinds alone."""
        e = tables.events.c
        query = (
            sa.select(
                e.id,
                e.campaign_id.label("campaign"),
                e.at,
                e.t_s,
                e.kind,
                e.level,
                e.message,
                e.device,
                e.value,
                e.limit_value.label("limit"),
                e.unit,
            )
            .where(e.campaign_id == campaign, e.id > after, *([e.kind.in_(kinds)] if kinds else []))
            .order_by(e.id)
            .limit(limit)
        )
        with self._database.reading() as connection:
            return records_of(EventRow, connection.execute(query))

    def unfinished(self) -> list[CampaignRow]:
        """Return campaigns that a process left without an end."""
        return self._rows(tables.campaigns.c.state.in_(UNFINISHED))

    @transaction
    def close_unfinished(
        self,
        campaign: int,
        reason: str,
        at: datetime,
        state: Literal[CampaignState.FAILED, CampaignState.ABORTED] = CampaignState.FAILED,
    ) -> None:
        """Mark a campaign that no process runs any more as over, with the reason."""
        with self._database.reading() as connection:
            records = of_campaign(connection, campaign)
        prepared = prepared_recordings(self._database, records)
        with (
            self._database.writing() as connection,
            changing(connection, records, at, CampaignState(state).value, prepared),
        ):
            connection.execute(
                sa.update(tables.campaigns)
                .where(tables.campaigns.c.id == campaign)
                .values(state=state, reason=reason, ended_at=at)
            )
            append(connection, at, "campaign state", f"campaign {campaign}", {"state": state, "reason": reason})


def _audited(new: NewCampaign) -> dict[str, object]:
    """Return what the audit trail keeps of the start of a campaign."""
    simulation = new.bench.get("simulation")
    optional = {
        "drivers": new.bench.get("drivers"),
        "reported": new.bench.get("reported"),
        "hidden": simulation.get("hidden") if isinstance(simulation, Mapping) else None,
        "bench_clear": new.bench_clear,
    }
    return {
        "recipe": new.recipe_name,
        "bench": new.bench_name,
        "units": [str(unit.info["serial"]) for unit in new.units],
        "schedule_hash": new.schedule_hash,
        **{name: value for name, value in optional.items() if value},
    }


def _confirmed(connection: sa.Connection, campaign: int, text: str, at: datetime) -> None:
    """Write down, as the first event of a campaign, what a person confirmed about its bench."""
    event = {"campaign_id": campaign, "at": at, "t_s": 0.0, "kind": BENCH_CLEAR, "level": "info", "message": text}
    connection.execute(sa.insert(tables.events).values(**event))
