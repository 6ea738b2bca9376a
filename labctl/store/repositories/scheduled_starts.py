"""Scheduled starts: campaigns that are to begin later, and the outcome of each past start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Literal

import sqlalchemy as sa

from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories import audit
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables

#: `claimed`: being started by the process that wrote it. The others are final.
Outcome = Literal["claimed", "started", "refused", "missed"]

#: States of an entry that a person still has to know of; `cancel` ends them.
_OPEN = ("waiting", "missed")


@dataclass(frozen=True)
class NewStart:
    """A campaign that is to begin later."""

    bench_name: str
    recipe_name: str
    recipe: str  #: the name of a shipped recipe, or the recipe itself
    clip: bool
    priority: int
    cron: str | None
    time_zone: str
    late_limit_s: float | None  #: how much later than due it may begin; None: any time
    due_at: datetime
    confirmed_by: str | None  #: who confirmed that the bench will be clear; None: not asked
    visits_s: Sequence[float] | None  #: when the plan needs a person, s from its begin; None: not known
    hide: Sequence[str] | None  #: effects hidden in the units of a simulated bench; None: none
    fit: bool  #: whether it ends in a draft where its recipe says so


@dataclass(frozen=True)
class StartRow(NewStart):
    """An entry of the schedule. State: waiting, missed (a single start that was too late), ended, cancelled."""

    id: int
    state: str
    created_at: datetime


@dataclass(frozen=True)
class StartEventRow:
    """Outcome of one past start."""

    id: int
    start: int
    at: datetime
    due_at: datetime
    outcome: Outcome
    message: str
    campaign: int | None
    after_campaign: int  #: the newest campaign when it was claimed


class Starts:
    """The schedule."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def add(self, new: NewStart, at: datetime) -> int:
        """Enter a start; returns its number."""
        row = sa.insert(tables.scheduled_starts).values(**asdict(new), state="waiting", created_at=at)
        with self._database.writing() as connection:
            number = int(connection.scalar(row.returning(tables.scheduled_starts.c.id)) or 0)
            details = {"recipe": new.recipe_name, "due_at": new.due_at.isoformat(), "cron": new.cron}
            if new.confirmed_by:
                details["bench_clear_confirmed_by"] = new.confirmed_by
            audit.append(connection, at, "schedule enter", _subject(number, new.bench_name), details)
        return number

    def get(self, start: int) -> StartRow:
        """Return one entry; raises NotFound."""
        rows = self._rows(tables.scheduled_starts.c.id == start)
        if not rows:
            raise NotFound(
                f"scheduled start {start} is not in this database; `labctl campaign schedule list` shows the starts"
            )
        return rows[0]

    def all(self, *, ended: bool) -> list[StartRow]:
        """Return what waits, next first, and what was missed and not removed since; with `ended` all entries."""
        s = tables.scheduled_starts.c
        return self._rows(sa.true() if ended else s.state.in_(_OPEN), s.due_at, s.id)

    def due(self, bench_name: str, at: datetime) -> list[StartRow]:
        """Return what should have begun on a bench by `at`: highest priority first, then the longest due."""
        s = tables.scheduled_starts.c
        waiting = sa.and_(s.bench_name == bench_name, s.state == "waiting", s.due_at <= at)
        return self._rows(waiting, s.priority.desc(), s.due_at, s.id)

    def _rows(self, condition: sa.ColumnElement[bool], *order: sa.ColumnElement[object]) -> list[StartRow]:
        s = tables.scheduled_starts.c
        query = sa.select(
            s.bench_name, s.recipe_name, s.recipe, s.clip, s.priority, s.cron, s.time_zone, s.late_limit_s, s.due_at,
            s.confirmed_by, s.visits_s, s.hide, s.fit, s.id, s.state, s.created_at,
        )  # fmt: skip
        with self._database.reading() as connection:
            rows = connection.execute(query.where(condition).order_by(*order)).mappings().all()
        return [StartRow(**dict(row)) for row in rows]

    @transaction
    def take(
        self, row: StartRow, due_at: datetime, next_due: datetime | None, at: datetime, outcome: Outcome, message: str
    ) -> StartEventRow | None:
        """Take a start that is due out of the queue and write down why; returns the event.

        The entry waits for `next_due` from then on, or is over; one that was missed stays in the list until a person
        removes it. None when it was cancelled or taken meanwhile.
        """
        s = tables.scheduled_starts
        mine = sa.update(s).where(s.c.id == row.id, s.c.state == "waiting", s.c.due_at == row.due_at)
        over = "missed" if outcome == "missed" else "ended"
        after = mine.values(state=over) if next_due is None else mine.values(due_at=next_due)
        newest = sa.select(sa.func.coalesce(sa.func.max(tables.campaigns.c.id), 0))
        with self._database.writing() as connection:
            if connection.execute(after).rowcount != 1:
                return None
            after_campaign = int(connection.scalar(newest) or 0)
            event = sa.insert(tables.start_events).values(
                start_id=row.id, at=at, due_at=due_at, outcome=outcome, message=message, after_campaign=after_campaign
            )
            number = int(connection.scalar(event.returning(tables.start_events.c.id)) or 0)
            if outcome != "claimed":
                _note(connection, at, row.id, outcome, message, None)
        return StartEventRow(number, row.id, at, due_at, outcome, message, None, after_campaign)

    @transaction
    def conclude(
        self, event: StartEventRow, at: datetime, outcome: Outcome, message: str, campaign: int | None = None
    ) -> None:
        """Write down what became of a start that was claimed."""
        e = tables.start_events
        values = {"outcome": outcome, "message": message, "campaign_id": campaign}
        with self._database.writing() as connection:
            connection.execute(sa.update(e).where(e.c.id == event.id).values(**values))
            _note(connection, at, event.start, outcome, message, campaign)

    @transaction
    def put_back(self, event: StartEventRow) -> None:
        """Undo a claim that came to nothing: the start is due again, unless it was cancelled."""
        s, e = tables.scheduled_starts, tables.start_events
        with self._database.writing() as connection:
            connection.execute(sa.delete(e).where(e.c.id == event.id))
            connection.execute(
                sa.update(s)
                .where(s.c.id == event.start, s.c.state != "cancelled")
                .values(state="waiting", due_at=event.due_at)
            )

    def open_claims(self, bench_name: str) -> list[StartEventRow]:
        """Return the starts on a bench that a process claimed and did not conclude."""
        s, e = tables.scheduled_starts, tables.start_events
        condition = sa.and_(e.c.outcome == "claimed", s.c.id == e.c.start_id, s.c.bench_name == bench_name)
        return self._events(condition)

    def events(self, start: int) -> list[StartEventRow]:
        """Return what became of an entry's starts, oldest first."""
        return self._events(tables.start_events.c.start_id == start)

    def _events(self, condition: sa.ColumnElement[bool]) -> list[StartEventRow]:
        e = tables.start_events.c
        query = (
            sa.select(
                e.id,
                e.start_id.label("start"),
                e.at,
                e.due_at,
                e.outcome,
                e.message,
                e.campaign_id.label("campaign"),
                e.after_campaign,
            )
            .where(condition)
            .order_by(e.id)
        )
        with self._database.reading() as connection:
            return records_of(StartEventRow, connection.execute(query))

    @transaction
    def cancel(self, start: int, at: datetime) -> None:
        """End an entry; what it has started runs on. Raises NotFound, Conflict."""
        row = self.get(start)
        s = tables.scheduled_starts
        entry = sa.update(s).where(s.c.id == start, s.c.state.in_(_OPEN))
        with self._database.writing() as connection:
            if connection.execute(entry.values(state="cancelled")).rowcount != 1:
                raise Conflict(
                    f"scheduled start {start} has already ended (state: {self.get(start).state}); add a new "
                    "start to the schedule"
                )
            audit.append(
                connection, at, "schedule cancel", _subject(start, row.bench_name), {"recipe": row.recipe_name}
            )


def _subject(start: int, bench_name: str) -> str:
    return f"start {start} on bench {bench_name}"


def _note(
    connection: sa.Connection, at: datetime, start: int, outcome: Outcome, message: str, campaign: int | None
) -> None:
    """Add to the audit trail what became of a start, which happens without a person."""
    s = tables.scheduled_starts.c
    bench_name = connection.scalar(sa.select(s.bench_name).where(s.id == start)) or ""
    detail = {"outcome": outcome, "message": message, "campaign": campaign}
    audit.append(connection, at, "schedule start", _subject(start, bench_name), detail)
