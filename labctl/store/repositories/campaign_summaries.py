"""Where campaigns are, for lists and status: a fixed number of statements for a page of campaigns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from labctl.answers.steps import StepJson
from labctl.store.connection.database import Database
from labctl.store.schema import tables

#: Campaigns asked for in one page: SQLite takes some thousand values in one statement.
PAGE = 500


@dataclass(frozen=True)
class CurrentStep:
    """The step that began last."""

    number: int  #: from 0
    kind: str
    body: StepJson


@dataclass(frozen=True)
class LastEnvironment:
    """The environment as it was logged last, degrees Celsius."""

    t_s: float | None = None
    temperature_c: float | None = None
    chamber_c: float | None = None
    setpoint_c: float | None = None


@dataclass(frozen=True)
class CampaignSummary:
    """How far one campaign is, from its rows."""

    steps: int = 0
    done_s: float = 0.0  #: expected duration of the steps that are done
    left_s: float = 0.0  #: expected duration of the steps that are planned or running
    current: CurrentStep | None = None
    last_at: datetime | None = None  #: of the last event
    last_t_s: float | None = None  #: of the last event, campaign time
    last_error: str | None = None
    repeated: int = 0  #: data sets that were taken again
    stalled_s: float = 0.0  #: how long the computer did not run labctl, s of real time
    environment: LastEnvironment = LastEnvironment()
    dropped: Mapping[str, str] = field(
        default_factory=dict
    )  #: gyro -> why it is excluded from the rest of the campaign


class CampaignSummaries:
    """Summaries of campaigns; no event, step or reading is loaded that a summary does not show."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of(self, campaigns: Sequence[int]) -> dict[int, CampaignSummary]:
        """Return the summary of each campaign, by its number."""
        summaries: dict[int, CampaignSummary] = {}
        with self._database.reading() as connection:
            for start in range(0, len(campaigns), PAGE):
                summaries |= _page(connection, campaigns[start : start + PAGE])
        return summaries


def _page(connection: sa.Connection, numbers: Sequence[int]) -> dict[int, CampaignSummary]:
    values: dict[int, dict[str, Any]] = {number: {} for number in numbers}
    for part in (_step_sums, _current_steps, _last_events, _last_errors, _hindrances, _environments, _dropped):
        for number, columns in part(connection, numbers):
            values[number] |= columns
    return {number: CampaignSummary(**columns) for number, columns in values.items()}


_Found = Iterable[tuple[int, dict[str, Any]]]


def _step_sums(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    s = tables.steps.c

    def expected_s(*states: str) -> sa.ColumnElement[float]:
        return sa.func.coalesce(sa.func.sum(sa.case((s.state.in_(states), s.expected_s), else_=0.0)), 0.0)

    query = (
        sa.select(s.campaign_id, sa.func.count(), expected_s("done"), expected_s("planned", "running"))
        .where(s.campaign_id.in_(numbers))
        .group_by(s.campaign_id)
    )
    for number, steps, done_s, left_s in connection.execute(query):
        yield number, {"steps": steps, "done_s": done_s, "left_s": left_s}


def _current_steps(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    s = tables.steps.c
    newest = (
        sa.select(s.campaign_id, sa.func.max(s.number).label("number"))
        .where(s.campaign_id.in_(numbers), s.started_s.is_not(None))
        .group_by(s.campaign_id)
        .subquery()
    )
    query = (
        sa.select(s.campaign_id, s.number, s.kind, s.body)
        .select_from(tables.steps)
        .join(newest, (newest.c.campaign_id == s.campaign_id) & (newest.c.number == s.number))
    )
    for row in connection.execute(query):
        yield row.campaign_id, {"current": CurrentStep(number=row.number, kind=row.kind, body=row.body)}


def _last_events(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    c, e, newer = tables.campaigns.c, tables.events.c, tables.events.alias("newer")
    newest = sa.select(sa.func.max(newer.c.id)).where(newer.c.campaign_id == c.id).scalar_subquery()
    query = (
        sa.select(c.id, e.at, e.t_s)
        .select_from(tables.campaigns)
        .join(tables.events, e.id == newest)
        .where(c.id.in_(numbers))
    )
    for number, at, t_s in connection.execute(query):
        yield number, {"last_at": at, "last_t_s": t_s}


def _last_errors(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    c, e, newer = tables.campaigns.c, tables.events.c, tables.events.alias("newer")
    newest = sa.select(sa.func.max(newer.c.id)).where(newer.c.campaign_id == c.id, newer.c.level == "error")
    query = (
        sa.select(c.id, e.message)
        .select_from(tables.campaigns)
        .join(tables.events, e.id == newest.scalar_subquery())
        .where(c.id.in_(numbers))
    )
    for number, message in connection.execute(query):
        yield number, {"last_error": message}


def _hindrances(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    e = tables.events.c
    query = (
        sa.select(
            e.campaign_id,
            sa.func.sum(sa.case((e.kind == "data_set_repeated", 1), else_=0)),
            sa.func.coalesce(sa.func.sum(sa.case((e.kind == "host_stalled", e.value), else_=0.0)), 0.0),
        )
        .where(e.campaign_id.in_(numbers), e.kind.in_(("data_set_repeated", "host_stalled")))
        .group_by(e.campaign_id)
    )
    for number, repeated, stalled_s in connection.execute(query):
        yield number, {"repeated": repeated, "stalled_s": stalled_s}


def _environments(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    r, e, newer = tables.recordings.c, tables.environment.c, tables.environment.alias("newer")
    newest = sa.select(sa.func.max(newer.c.id)).where(newer.c.recording_id == r.id).scalar_subquery()
    query = (
        sa.select(r.campaign_id, e.t_s, e.temperature_c, e.chamber_c, e.chamber_setpoint_c)
        .select_from(tables.recordings)
        .join(tables.environment, e.id == newest)
        .where(r.campaign_id.in_(numbers))
        .order_by(e.id)  # of several units the last one wins
    )
    for row in connection.execute(query):
        logged = LastEnvironment(
            t_s=row.t_s, temperature_c=row.temperature_c, chamber_c=row.chamber_c, setpoint_c=row.chamber_setpoint_c
        )
        yield row.campaign_id, {"environment": logged}


def _dropped(connection: sa.Connection, numbers: Sequence[int]) -> _Found:
    r = tables.recordings.c
    query = sa.select(r.campaign_id, r.gyro, r.dropped).where(r.campaign_id.in_(numbers), r.dropped.is_not(None))
    dropped_by_campaign: dict[int, dict[str, str]] = {}
    for number, gyro, reason in connection.execute(query):
        dropped_by_campaign.setdefault(number, {})[gyro] = reason
    for number, dropped in dropped_by_campaign.items():
        yield number, {"dropped": dropped}
