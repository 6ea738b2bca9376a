"""Figures of many units, aggregated in the database: by type, and what a report on a type is computed from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from labctl.answers.json_object import JsonDocument
from labctl.store.connection.database import Database
from labctl.store.repositories.fleet_filter import FleetFilter
from labctl.store.repositories.units import UNSEEN
from labctl.store.schema import tables
from labctl.store.schema.types import EPOCH

#: Edges of the classes of error over noise floor; below the first and above the last are classes too.
RATIO_EDGES = (1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0)
#: Versions that are read at a time: some 14 kB each.
VERSIONS_AT_ONCE = 200


@dataclass
class TypeFigures:
    """Figures of the units of one type."""

    type: str
    units: int = 0
    ratios: dict[int, int] = field(default_factory=dict)  #: class of error over floor -> units
    verdicts: dict[str, int] = field(default_factory=dict)
    named: dict[str, int] = field(default_factory=dict)  #: ids of effects with commas -> units that name them
    due: dict[str, int] = field(default_factory=dict)  #: overdue, 30_days, 90_days, later, no_date -> units

    def add_results(self, class_: int | None, verdict: str | None, named: str | None, units: int) -> None:
        """Count units whose newest results by fleet jobs are these; None: there is none."""
        if class_ is not None:
            self.ratios[class_] = self.ratios.get(class_, 0) + units
        if verdict is not None:
            self.verdicts[verdict] = self.verdicts.get(verdict, 0) + units
        if named is not None:
            self.named[named] = self.named.get(named, 0) + units


@dataclass(frozen=True)
class FleetVersion:
    """The newest version by a recording of a unit, with the groups that the unit belongs to."""

    serial: str
    batch: str
    supplier: str
    bench: str | None  #: None: the recording was imported
    info: JsonDocument
    document: bytes


@dataclass(frozen=True)
class ChartPoint:
    """A coefficient over the units of one group that were measured in one span of time."""

    level: str
    at: datetime  #: mean of the times of the measurements
    units: int
    mean: float
    low: float
    high: float
    mean_u: float | None


class FleetReports:
    """Figures of many units."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def types(self, wanted: FleetFilter, now: datetime) -> list[TypeFigures]:
        """Return the figures of every type, by name."""
        with self._database.reading() as connection:
            u = tables.units.c
            counted = sa.select(u.model, sa.func.count()).where(wanted.of_measured).group_by(u.model).order_by(u.model)
            figures = {model: TypeFigures(model, n) for model, n in connection.execute(counted)}
            for unseen in UNSEEN:
                for model, n in connection.execute(counted.where(unseen)):
                    figures[model].units -= n
            for model, class_, verdict, named, n in connection.execute(_results(wanted)):
                figures[model].add_results(class_, verdict, named, n)
            for model, key, n in connection.execute(_due(wanted, now)):
                figures[model].due[key] = n
        return [each for each in figures.values() if each.units]

    def state(self, wanted: FleetFilter) -> str:
        """Return a text that changes with every version and criticism that a report would be computed from."""
        c, x, e = tables.calibrations.c, tables.fleet_units.c, tables.fleet_evidence.c
        ours = sa.select(tables.units.c.serial).where(wanted.condition)
        versions = sa.select(sa.func.count(), sa.func.max(c.id)).where(c.serial.in_(ours))
        judged = sa.select(sa.func.count(), sa.func.max(x.job_id)).where(x.newest, x.serial.in_(ours))
        evidence = sa.select(sa.func.count(), sa.func.max(e.id)).where(e.type == wanted.type)
        groups = sa.select(sa.func.count(), sa.func.count(sa.distinct(tables.units.c.batch))).where(
            tables.units.c.serial.in_(ours)
        )
        with self._database.reading() as connection:
            rows = [tuple(connection.execute(query).one()) for query in (versions, judged, evidence, groups)]
            stated = connection.scalar(
                sa.select(sa.func.max(tables.audit.c.id)).where(tables.audit.c.action == "unit batch")
            )
        return repr((rows, stated))

    def versions(self, wanted: FleetFilter, most: int) -> Iterator[FleetVersion]:
        """Yield the newest version by each recording of each unit, those of the newest recordings first."""
        c, r, u, k = tables.calibrations.c, tables.recordings.c, tables.units.c, tables.campaigns.c
        newest = sa.select(sa.func.max(c.id).label("id")).where(c.recording_id.is_not(None))
        newest_ids = newest.group_by(c.serial, c.recording_id).subquery()
        joined = (
            tables.calibrations.join(tables.units, u.serial == c.serial)
            .join(tables.recordings, r.id == c.recording_id)
            .outerjoin(tables.campaigns, k.id == r.campaign_id)
        )
        ours = sa.select(u.serial).where(wanted.condition)
        with_newest = sa.join(tables.calibrations, newest_ids, newest_ids.c.id == c.id)
        which = sa.select(c.id).select_from(with_newest).where(c.serial.in_(ours)).order_by(c.recording_id.desc())
        columns = (c.serial, u.batch, u.supplier, k.bench_name, r.info, c.document)
        with self._database.reading() as connection:
            ids = list(connection.scalars(which.limit(most)))
        for first in range(0, len(ids), VERSIONS_AT_ONCE):
            some = ids[first : first + VERSIONS_AT_ONCE]
            with self._database.reading() as connection:
                query = sa.select(*columns).select_from(joined).where(c.id.in_(some))
                rows = connection.execute(query.order_by(c.recording_id.desc())).all()
            for row in rows:
                yield FleetVersion(row[0], row[1], row[2], row[3], row[4], bytes(row[5]))

    def evidence(self, type_: str, model: str) -> tuple[list[bytes], int]:
        """Return the sums that count of a type and error model, and how many units are in sums that do not."""
        e, x = tables.fleet_evidence.c, tables.fleet_units.c
        newest = sa.select(x.evidence_id, sa.func.count().label("n")).where(x.newest, x.evidence_id.is_not(None))
        held = newest.group_by(x.evidence_id).subquery()
        query = sa.select(e.id, e.units, held.c.n).join(held, held.c.evidence_id == e.id).where(e.type == type_)
        if model:
            query = query.where(e.model == model)
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(e.id)).all()
            whole = [row.id for row in rows if row.n == row.units]
            contents = [bytes(connection.scalar(sa.select(e.content).where(e.id == number)) or b"") for number in whole]
        return contents, sum(row.n for row in rows if row.n != row.units)

    def coefficients(self, wanted: FleetFilter) -> list[tuple[str, str, str, int]]:
        """Return (axis, name, unit, units) of every coefficient of a type that a chart can show."""
        f, u = tables.fleet_coefficients.c, tables.units.c
        query = sa.select(f.axis, f.name, f.unit, sa.func.count()).join(tables.units, u.serial == f.serial)
        grouped = query.where(wanted.condition).group_by(f.axis, f.name, f.unit).order_by(f.axis, f.name)
        with self._database.reading() as connection:
            return [(axis, name, unit_symbol, n) for axis, name, unit_symbol, n in connection.execute(grouped)]

    def chart(
        self, wanted: FleetFilter, axis: str, name: str, factor: str, spans: int
    ) -> tuple[list[ChartPoint], tuple[datetime, datetime] | None]:
        """Return a coefficient by group and span of time, and from when to when it was measured."""
        f, u = tables.fleet_coefficients.c, tables.units.c
        joined = sa.join(tables.fleet_coefficients, tables.units, u.serial == f.serial)
        ours = sa.and_(wanted.condition, f.axis == axis, f.name == name, f.measured_at.is_not(None))
        with self._database.reading() as connection:
            limits = sa.select(sa.func.min(f.measured_at), sa.func.max(f.measured_at)).select_from(joined).where(ours)
            first, last = connection.execute(limits).one()
            if first is None or last is None:
                return [], None
            width = max((last - first) / spans, timedelta(seconds=1))
            query = _chart_query(joined, ours, factor, first, width)
            return [_chart_point(row) for row in connection.execute(query)], (first, last)


def _results(wanted: FleetFilter) -> sa.Select[*tuple[Any, ...]]:
    """Return the query of (type, class of error over floor, verdict, effects named, units): one pass over all results.

    A fit has no verdict, a criticism no class.
    """
    u, x = tables.units.c, tables.fleet_units.c
    is_fit = sa.and_(x.kind == "fit", x.rms_dps.is_not(None), x.noise_floor_dps > 0.0)
    ratio = sa.case((is_fit, x.rms_dps / x.noise_floor_dps))
    above = sa.case(*((ratio < edge, i) for i, edge in enumerate(RATIO_EDGES)), else_=len(RATIO_EDGES))
    class_ = sa.case((is_fit, above))
    verdict = sa.case((x.kind == "criticise", x.verdict))
    named = sa.case(
        (sa.and_(x.kind == "criticise", x.verdict.in_(("missing", "ambiguous"))), sa.cast(x.named, sa.Text))
    )
    joined = sa.join(tables.units, tables.fleet_units, x.serial == u.serial)
    query = sa.select(u.model, class_.label("class_"), verdict.label("verdict"), named.label("named"), sa.func.count())
    grouped = query.select_from(joined).where(x.newest, wanted.of_measured)
    return grouped.group_by(u.model, sa.literal_column("2"), sa.literal_column("3"), sa.literal_column("4"))


def _due(wanted: FleetFilter, now: datetime) -> sa.Select[*tuple[Any, ...]]:
    """Return the query of (type, due, units) of units with a version in force: the newest act of each certifies."""
    u, a = tables.units.c, tables.certifications.c
    later = tables.certifications.alias()
    is_newest = ~sa.exists().where(later.c.serial == a.serial, later.c.id > a.id)

    def until(days: int) -> sa.ColumnElement[bool]:
        return a.due_at <= now + timedelta(days=days)

    due = sa.case(
        (a.due_at.is_(None), "no_date"), (until(0), "overdue"), (until(30), "30_days"), (until(90), "90_days"),
        else_="later",
    )  # fmt: skip
    joined = sa.join(tables.units, tables.certifications, a.serial == u.serial)
    query = sa.select(u.model, due, sa.func.count()).select_from(joined)
    return query.where(a.act == "certify", is_newest, wanted.of_measured).group_by(u.model, due)


def _chart_query(
    joined: sa.Join, ours: sa.ColumnElement[bool], factor: str, first: datetime, width: timedelta
) -> sa.Select[*tuple[Any, ...]]:
    f = tables.fleet_coefficients.c
    level = {"bench": f.bench, "batch": tables.units.c.batch, "supplier": tables.units.c.supplier}[factor]
    instant = sa.type_coerce(f.measured_at, sa.BigInteger)
    first_us = (first - EPOCH) // timedelta(microseconds=1)
    span = (instant - first_us) / sa.literal(width // timedelta(microseconds=1), sa.BigInteger)
    span = sa.cast(sa.func.floor(span), sa.BigInteger)
    query = sa.select(
        level.label("level"), sa.cast(sa.func.avg(instant - first_us), sa.Float).label("after_us"),
        sa.literal(first, tables.Instant()).label("first"), sa.func.count().label("units"),
        sa.func.avg(f.value).label("mean"), sa.func.min(f.value).label("low"), sa.func.max(f.value).label("high"),
        sa.func.avg(f.u).label("mean_u"),
    ).select_from(joined)  # fmt: skip
    return query.where(ours).group_by(level, span).order_by(level, span)


def _chart_point(row: sa.Row[Any]) -> ChartPoint:
    at = row.first + timedelta(microseconds=round(row.after_us))
    return ChartPoint(row.level, at, row.units, row.mean, row.low, row.high, row.mean_u)
