"""Runs that time the step clock of a table, and the rates of the data sets that are by them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import sqlalchemy as sa

from instruments.standards import MEASURED_STEP_CLOCK
from labctl.store.schema import tables
from procedures.contracts.journal import ClockRun


def timed_runs(connection: sa.Connection, campaign: int) -> tuple[ClockRun, ...]:
    """Return the runs of a campaign in their order."""
    t = tables.timed_runs.c
    columns = (t.session, t.block, t.t_s, t.nominal_s, t.duration_s, t.step_hz, t.used)
    rows = connection.execute(sa.select(*columns).where(t.campaign_id == campaign).order_by(t.id)).mappings()
    return tuple(ClockRun(**row) for row in rows)


def write_step_clock(
    connection: sa.Connection, campaign: int, measured: Mapping[str, object], factor: Callable[[float], float]
) -> None:
    """Apply the timed runs of this session: correct the rates of the data sets, and state their uncertainty.

    Runs of an earlier session that never counted stay so: they disagreed, or the session ended before they were used.
    `measured` replaces what the head of a recording says of that standard; `factor` is by the campaign time of a gate.
    """
    r, t = tables.recordings, tables.timed_runs
    rows = connection.execute(sa.select(r.c.id, r.c.info).where(r.c.campaign_id == campaign))
    recordings = {row.id: row.info for row in rows}
    _correct_rates(connection, list(recordings), factor)
    for key, info in recordings.items():
        used_standards = info.get("standards", ())
        standards = [
            {**used_standard, **measured} if used_standard.get("name") == MEASURED_STEP_CLOCK else used_standard
            for used_standard in used_standards
        ]
        connection.execute(sa.update(r).where(r.c.id == key).values(info={**info, "standards": standards}))
    session = sa.select(sa.func.max(t.c.session)).where(t.c.campaign_id == campaign).scalar_subquery()
    connection.execute(sa.update(t).where(t.c.campaign_id == campaign, t.c.session == session).values(used=True))


def _correct_rates(connection: sa.Connection, recordings: list[int], factor: Callable[[float], float]) -> None:
    d = tables.data_sets
    at_constant_rate = (d.c.recording_id.in_(recordings), d.c.table_rate_dps != 0.0, d.c.turn_deg.is_(None))
    query = sa.select(d.c.recording_id, d.c.number, d.c.table_rate_dps, d.c.gate_from_s).where(*at_constant_rate)
    changes = [
        {"of": row.recording_id, "at": row.number, "rate": row.table_rate_dps * factor(row.gate_from_s)}
        for row in connection.execute(query)
    ]
    if changes:
        this = (d.c.recording_id == sa.bindparam("of"), d.c.number == sa.bindparam("at"))
        connection.execute(sa.update(d).where(*this).values(table_rate_dps=sa.bindparam("rate")), changes)
