"""Campaigns that a process left without an end: the step where each resumes, and resuming it in one transaction."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from labctl.errors import Conflict
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories.audit import append
from labctl.store.repositories.campaign_journal import StoreJournal
from labctl.store.repositories.sample_blocks import blocks_of
from labctl.store.repositories.timed_runs import timed_runs
from labctl.store.schema import tables
from labctl.store.sealing.seals import changing, of_campaign, prepared_recordings
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import ClockRun, DataSetState
from procedures.contracts.steps import StepResult

#: Events after which a temperature has to be soaked again, and events after which it has been.
OWED, PAID = ("taken_up", "soak_owed"), ("lead_in_done", "soaked_again")
FINISHED = frozenset({"done", "skipped"})


@dataclass(frozen=True)
class ResumePoint:
    """Where a campaign resumes that no process runs."""

    start_at: int  #: the first step that has to be run, or run again because its data set was withdrawn
    complete: frozenset[int]  #: steps whose data set was complete when the process ended, before their end was recorded
    skipped: frozenset[int]
    last_t_s: float  #: campaign time of the last sign of life
    last_at: datetime
    soak_owed: bool
    added_runs: int
    boot_id: str | None
    dropped: dict[str, str]  #: gyro -> why it is excluded from the rest of the campaign
    clock_runs: tuple[ClockRun, ...]  #: that timed the step clock
    tries: int  #: how often it was resumed since a step ended


@dataclass(frozen=True)
class Resumption:
    """What is written down when a campaign is resumed."""

    t_s: float
    at: datetime
    reason: str
    added_runs: int
    new_session: bool
    boot_id: str | None


class ResumePoints:
    """Where interrupted campaigns resume."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of_campaign(self, campaign: int) -> ResumePoint:
        """Return where a campaign resumes, from its rows alone."""
        c, s, r, d = tables.campaigns.c, tables.steps.c, tables.recordings.c, tables.data_sets.c
        with self._database.reading() as connection:
            row = connection.execute(
                sa.select(c.created_at, c.started_at, c.added_runs, c.boot_id).where(c.id == campaign)
            ).one()
            steps = connection.execute(
                sa.select(s.number, s.state, s.body, s.ended_s).where(s.campaign_id == campaign).order_by(s.number)
            ).all()
            units = connection.execute(sa.select(r.id, r.gyro, r.dropped).where(r.campaign_id == campaign)).all()
            recordings = [unit[0] for unit in units]
            planned = set(
                connection.scalars(
                    sa.select(d.planned).where(d.recording_id.in_(recordings), d.state == DataSetState.COMPLETE.value)
                )
            )
            withdrawn = self._withdrawn(connection, [unit[0] for unit in units if unit[2] is None])
            last_t_s = self._last_t_s(connection, campaign, recordings)
            ended_s = max((step[3] for step in steps if step[3] is not None), default=-1.0)
            owed, tries = self._events(connection, campaign, ended_s)
            runs = timed_runs(connection, campaign)
        complete = frozenset(
            step[0] for step in steps if step[1] not in FINISHED and step[2].get("dataset") in planned - {None}
        )
        again = {step[0] for step in steps if step[1] == "done" and step[2].get("dataset") in withdrawn}
        steps_left = [
            step[0] for step in steps if step[0] in again or (step[1] not in FINISHED and step[0] not in complete)
        ]
        return ResumePoint(
            start_at=steps_left[0] if steps_left else len(steps),
            complete=complete,
            skipped=frozenset(step[0] for step in steps if step[1] == "skipped"),
            last_t_s=last_t_s,
            last_at=(row.started_at or row.created_at) + timedelta(seconds=last_t_s),
            soak_owed=owed,
            added_runs=row.added_runs,
            boot_id=row.boot_id,
            dropped={unit[1]: unit[2] for unit in units if unit[2] is not None},
            clock_runs=runs,
            tries=tries,
        )

    @staticmethod
    def _withdrawn(connection: sa.Connection, recordings: list[int]) -> set[int]:
        """Return the planned data sets that some unit has only in part, although their step was done."""
        d = tables.data_sets.c
        rows = connection.execute(sa.select(d.recording_id, d.planned, d.state).where(d.recording_id.in_(recordings)))
        measured: dict[bool, set[tuple[int, int]]] = {True: set(), False: set()}
        for recording, planned, state in rows:
            if planned is not None:
                measured[state == DataSetState.COMPLETE.value].add((recording, planned))
        return {planned for _, planned in measured[False] - measured[True]}

    def _last_t_s(self, connection: sa.Connection, campaign: int, recordings: list[int]) -> float:
        e, v, d = tables.environment.c, tables.events.c, tables.data_sets.c
        times_s = [
            connection.scalar(sa.select(sa.func.max(v.t_s)).where(v.campaign_id == campaign)),
            connection.scalar(sa.select(sa.func.max(e.t_s)).where(e.recording_id.in_(recordings))),
            connection.scalar(
                sa.select(sa.func.max(d.gate_until_s)).where(d.recording_id.in_(recordings), d.state == "complete")
            ),
        ]
        newest = sa.select(d.recording_id, d.number).where(d.recording_id.in_(recordings), d.state != "complete")
        for recording, number in connection.execute(newest).all():
            times_s += [float(part["t_ns"][-1]) / 1e9 for part in blocks_of(connection, recording, number)[-1:]]
        return max((t_s for t_s in times_s if t_s is not None), default=0.0)

    @staticmethod
    def _events(connection: sa.Connection, campaign: int, ended_s: float) -> tuple[bool, int]:
        """Return whether a soak is owed, and how often the campaign was resumed since its last step ended."""
        v = tables.events.c

        def last(kinds: tuple[str, ...]) -> int:
            query = sa.select(sa.func.max(v.id)).where(v.campaign_id == campaign, v.kind.in_(kinds))
            return int(connection.scalar(query) or 0)

        tries = sa.select(sa.func.count()).where(v.campaign_id == campaign, v.kind == "taken_up", v.t_s >= ended_s)
        return last(OWED) > last(PAID), int(connection.scalar(tries) or 0)

    @transaction
    def mark_resumed(self, campaign: int, point: ResumePoint, how: Resumption) -> None:
        """Mark what the interruption left half done, and the campaign as running again. Safe to be interrupted itself.

        Raises Conflict when it is done already.
        """
        self._close_open_data_sets(campaign)
        c, s = tables.campaigns, tables.steps
        values: dict[str, Any] = {
            "state": CampaignState.RUNNING,
            "reason": how.reason,
            "ended_at": None,
            "boot_id": how.boot_id,
        }
        values["added_runs"] = how.added_runs
        if how.new_session:
            values["powered_on_s"] = how.t_s
        with self._database.reading() as connection:
            records = of_campaign(connection, campaign)
        prepared = prepared_recordings(self._database, records)
        with (
            self._database.writing() as connection,
            changing(connection, records, how.at, f"resumed: {how.reason}", prepared),
        ):
            updated = connection.execute(
                sa.update(c).where(c.c.id == campaign, c.c.state != CampaignState.DONE).values(**values)
            )
            if updated.rowcount == 0:
                raise Conflict(f"campaign {campaign} is done and cannot be resumed; start a new one")
            mine = s.c.campaign_id == campaign
            self._mark(connection, mine & s.c.number.in_(point.complete), "done", how, "its data set was complete")
            running = mine & (s.c.state == "running")
            self._mark(connection, running, "interrupted", how, "the process that ran it ended")
            append(connection, how.at, "campaign resume", f"campaign {campaign}", {"reason": how.reason})
            connection.execute(
                sa.insert(tables.events).values(
                    campaign_id=campaign,
                    at=how.at,
                    t_s=how.t_s,
                    kind="taken_up",
                    level="warning",
                    message=how.reason,
                )
            )

    @staticmethod
    def _mark(
        connection: sa.Connection,
        which: sa.ColumnElement[bool],
        outcome: str,
        how: Resumption,
        reason: str,
    ) -> None:
        result = StepResult.model_validate({"outcome": outcome, "reason": reason}).model_dump(mode="json")
        connection.execute(
            sa.update(tables.steps)
            .where(which)
            .values(
                state=outcome, ended_s=sa.func.coalesce(tables.steps.c.ended_s, how.t_s), ended_at=how.at, result=result
            )
        )

    def _close_open_data_sets(self, campaign: int) -> None:
        """Keep what a data set had when it was interrupted, and mark it; it is never merged with what redoes it."""
        r, d = tables.recordings.c, tables.data_sets.c
        query = (
            sa.select(d.number)
            .join(tables.recordings, r.id == d.recording_id)
            .where(r.campaign_id == campaign, d.state == DataSetState.OPEN.value)
            .distinct()
        )
        with self._database.reading() as connection:
            numbers = list(connection.scalars(query))
        journal = StoreJournal(self._database, campaign)
        for number in numbers:
            journal.dataset_closed(number, DataSetState.PARTIAL, "the process that took it ended")
