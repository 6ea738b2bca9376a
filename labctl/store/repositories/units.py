"""Units: gyros by serial number, and which calibration of each is in force, until when."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from functools import cache
from itertools import zip_longest
from typing import Any

import sqlalchemy as sa

from labctl.acting_user import acting_key
from labctl.errors import NotFound
from labctl.natural_order import natural_key
from labctl.store.connection.database import Database
from labctl.store.connection.lookup import Lookup, one_of_keys
from labctl.store.connection.transactions import transaction
from labctl.store.paging import Page, PageRequest, parts_of, rows_to_read
from labctl.store.records import CertificationRow, ServedCalibration, Unit, UnitHoldings, Withdrawal
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import record_of, records_of
from labctl.store.schema import tables


def _measured() -> sa.ColumnElement[bool]:
    r, s = tables.recordings.c, tables.sensor_versions.c
    is_complete = sa.exists().where(r.serial == tables.units.c.serial, r.importing.is_(None))
    return sa.or_(is_complete, sa.exists().where(s.serial == tables.units.c.serial))


#: Serial numbers that begin or end with so many equal characters are compared whole.
ALIKE = 3
#: So many of them at most, which takes some milliseconds.
MAX_COMPARED = 1000
#: The least similarity (difflib) of serial numbers that may be one number mistyped: one character of seven.
SIMILARITY = 0.85
#: A unit that only an import under way has brought in is not there yet.
SEEN = _measured()


def _unmeasured() -> tuple[sa.ColumnElement[bool], sa.ColumnElement[bool]]:
    u, r, s = tables.units.c, tables.recordings.c, tables.sensor_versions.c
    has_none = ~sa.exists().where(r.serial == u.serial)
    importing = u.serial.in_(sa.select(r.serial).where(r.importing > ""))  # not null; this SQLite finds by the index
    return sa.and_(has_none, ~sa.exists().where(s.serial == u.serial)), sa.and_(importing, ~SEEN)


#: Units that are not SEEN: those without a recording, and those with imports under way alone. They are counted in place
#: of the others: few units are so, and they are found by indexes, without each recording of each unit.
UNSEEN = _unmeasured()


def add_missing_unit(connection: sa.Connection, serial: str, model: str, technology: str | None, at: datetime) -> bool:
    """Keep a unit that is seen for the first time; returns whether it was."""
    known_serial = connection.scalar(sa.select(tables.units.c.serial).where(tables.units.c.serial == serial))
    if known_serial is None:
        connection.execute(
            sa.insert(tables.units).values(serial=serial, model=model, technology=technology, first_seen_at=at)
        )
    return known_serial is None


def remember_unit(connection: sa.Connection, serial: str, model: str, technology: str | None, at: datetime) -> None:
    """Keep a unit that is seen for the first time; fill in what was not known of it."""
    if add_missing_unit(connection, serial, model, technology, at):
        return
    row = connection.execute(sa.select(tables.units).where(tables.units.c.serial == serial)).one()
    if (model and not row.model) or (technology and not row.technology):
        connection.execute(
            sa.update(tables.units)
            .where(tables.units.c.serial == serial)
            .values(model=row.model or model, technology=row.technology or technology)
        )


@dataclass(frozen=True)
class UnitFilter:
    """Which units of a list: by their calibration at a time, and by the verdict on the version in force."""

    now: datetime
    calibration: str | None = None  #: in_force, overdue or none
    verdict: str | None = None
    batch: str | None = None  #: exactly this one

    @property
    def condition(self) -> sa.ColumnElement[bool]:
        """The condition on rows of the table of units."""
        of_unit = sa.select(sa.func.max(_X.id)).where(_X.serial == tables.units.c.serial)
        newest = of_unit.correlate(tables.units).scalar_subquery()
        act = tables.certifications.alias()
        in_force = sa.exists().where(act.c.id == newest, act.c.act == "certify")
        conditions = [] if self.batch is None else [tables.units.c.batch == self.batch]
        if self.calibration is not None:
            overdue = in_force.where(act.c.due_at <= self.now)
            by_state = {"in_force": in_force, "overdue": overdue, "none": sa.not_(in_force)}
            conditions.append(by_state[self.calibration])
        if self.verdict is not None:
            conditions.append(in_force.where(act.c.verdict == self.verdict))
        return sa.and_(sa.true(), *conditions)


@dataclass(frozen=True)
class BatchRow:
    """A batch of units, and how many are of it."""

    batch: str
    units: int


def unit_rows() -> sa.Select[*tuple[Any, ...]]:
    """Return the query for units, whose rows are of `Unit`."""
    return sa.select(*(tables.units.c[field.name] for field in fields(Unit)))


def search_units(request: PageRequest[str]) -> sa.ColumnElement[bool]:
    """Return the condition that a unit holds the text that is searched for."""
    c = tables.units.c
    return request.matching((c.serial, c.model, c.technology, c.batch, c.supplier))


def _count(connection: sa.Connection, condition: sa.ColumnElement[bool]) -> int:
    """Return how many measured units meet a condition: all that do without those that are not measured."""
    counted = sa.select(sa.func.count()).select_from(tables.units).where(condition)
    whole = connection.scalar(counted) or 0
    return whole - sum(connection.scalar(counted.where(unseen)) or 0 for unseen in UNSEEN)


class Units:
    """Gyros by serial number."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, serial: str) -> Unit:
        """Return a unit; raises NotFound, which says how a unit is added."""
        with self._database.reading() as connection:
            wanted = unit_rows().where(tables.units.c.serial == serial, SEEN)
            row = connection.execute(wanted).mappings().first()
        if row is None:
            raise NotFound(f"unit {serial!r} is not in this database; `labctl import DIR` or a campaign adds it")
        return record_of(Unit, row)

    def has(self, serial: str) -> bool:
        """Return whether a unit is there."""
        query = sa.select(tables.units.c.serial).where(tables.units.c.serial == serial, SEEN)
        with self._database.reading() as connection:
            return connection.scalar(query) is not None

    def most_similar(self, serial: str) -> str | None:
        """Return the serial number of the unit that differs from this one by least, such as by one digit; None: none.

        Compared are those of nearly the same length that begin or end alike.
        """
        known_serials, k = tables.units.c.serial, min(ALIKE, len(serial))
        begins = sa.func.substr(known_serials, 1, k) == serial[:k]
        ends = sa.func.substr(known_serials, sa.func.length(known_serials) - k + 1) == serial[-k:]
        near = sa.func.abs(sa.func.length(known_serials) - len(serial)) <= 1
        query = sa.select(known_serials).where(SEEN, near, begins | ends, known_serials != serial).limit(MAX_COMPARED)
        with self._database.reading() as connection:
            near_by = difflib.get_close_matches(serial, list(connection.scalars(query)), n=10, cutoff=SIMILARITY)
        return min(near_by, key=lambda each: sum(a != b for a, b in zip_longest(each, serial)), default=None)

    def count(self) -> int:
        """Return how many units there are."""
        with self._database.reading() as connection:
            return _count(connection, sa.true())

    def all(self) -> list[Unit]:
        """Return every unit, by serial number in natural order."""
        with self._database.reading() as connection:
            rows = connection.execute(unit_rows().where(SEEN).order_by(tables.units.c.serial_key))
            return records_of(Unit, rows)

    def page(self, request: PageRequest[str], wanted: UnitFilter | None = None) -> Page[Unit, str]:
        """Return units by serial number in natural order.

        Searched are serial number, model, technology, batch and supplier.
        """
        c = tables.units.c
        filtered = sa.true() if wanted is None else wanted.condition
        matches = search_units(request)
        query = unit_rows().where(matches, filtered, SEEN).order_by(c.serial_key).limit(rows_to_read(request))
        if request.after is not None:
            query = query.where(c.serial_key > natural_key(request.after))
        with self._database.reading() as connection:
            units = records_of(Unit, connection.execute(query))
            is_whole = request.after is None and (request.limit is None or len(units) <= request.limit)
            total = len(units) if is_whole else _count(connection, sa.and_(matches, filtered))
        return Page.of(units, lambda unit: unit.serial, request, total)

    def batches(self) -> list[BatchRow]:
        """Return every batch that a unit is of, by name, with the number of its units."""
        c = tables.units.c
        query = sa.select(c.batch, sa.func.count().label("units")).where(SEEN, c.batch != "").group_by(c.batch)
        with self._database.reading() as connection:
            return [BatchRow(row.batch, row.units) for row in connection.execute(query.order_by(c.batch))]

    @transaction
    def set_batch(self, serials: Sequence[str], batch: str, supplier: str | None, by: str, at: datetime) -> None:
        """State the batch of some units, and their supplier where one is given. Raises NotFound for one that is absent.

        Every change of a unit is in the audit trail with what was stated before; a unit that has the values already
        is left as it is.
        """
        c = tables.units.c
        with self._database.writing() as connection:
            stated: dict[str, sa.Row[Any]] = {}
            for some in parts_of(serials):
                query = sa.select(c.serial, c.batch, c.supplier).where(SEEN, c.serial.in_(some))
                stated |= {row.serial: row for row in connection.execute(query)}
            if missing := [serial for serial in serials if serial not in stated]:
                raise NotFound(
                    f"{len(missing)} of {len(serials)} units are not in this database, first {missing[0]!r}; no batch "
                    f"was stated: import or measure them first, or leave them out"
                )
            for serial, row in stated.items():
                new = {"batch": batch, "supplier": row.supplier if supplier is None else supplier}
                old = {"batch": row.batch, "supplier": row.supplier}
                if new == old:
                    continue
                connection.execute(sa.update(tables.units).where(c.serial == serial).values(**new))
                append(connection, at, "unit batch", serial, {**new, "before": old}, who=acting_key() or by)

    def holdings(self, serials: Sequence[str]) -> dict[str, UnitHoldings]:
        """Return the numbers of recordings, newest first, and of versions, rising, of each of some units."""
        r, v = tables.recordings.c, tables.calibrations.c
        held = {serial: UnitHoldings([], []) for serial in serials}
        some_of: sa.BindParameter[Sequence[str]] = sa.bindparam("serials", expanding=True)
        # sorted and without imports under way: here, because SQLite would read all recordings by another index for it
        recordings = sa.select(r.serial, r.id, r.importing).where(r.serial.in_(some_of))
        versions = sa.select(v.serial, v.version).where(v.serial.in_(some_of)).order_by(v.version)
        with self._database.reading() as connection:
            for some in parts_of(serials):
                rows = connection.execute(recordings, {"serials": some}).all()
                for serial, recording, importing in sorted(rows, key=lambda row: -row.id):
                    if importing is None:
                        held[serial].recordings.append(recording)
                for serial, version in connection.execute(versions, {"serials": some}):
                    held[serial].versions.append(version)
        return held


_C, _X = tables.calibrations.c, tables.certifications.c
_ACT = (_X.version.label("act_version"), _X.act, _X.by, _X.reason, _X.at, _X.due_at)
_LAST = sa.select(sa.func.max(_X.id)).where(_X.serial == sa.bindparam("serial")).correlate(None).scalar_subquery()


_Z, _W = tables.certificates.c, tables.certificate_withdrawals.c
_CERTIFICATE = (
    _Z.number.label("certificate"), _W.by.label("w_by"), _W.by_key.label("w_key"), _W.reason.label("w_reason"),
    _W.at.label("w_at"), _W.certification_id.label("w_act"),
)  # fmt: skip
_SERVED = (*_ACT, sa.cast(_X.assessment, sa.Text).label("judgement"), *_CERTIFICATE)


def _with_certificate(joined: sa.FromClause) -> sa.Join:
    """Join the newest certificate of each version of calibrations, and its withdrawal, where there are any."""
    inner = tables.certificates.alias()
    newest = (
        sa.select(sa.func.max(inner.c.id))
        .where(inner.c.serial == _C.serial, inner.c.version == _C.version)
        .correlate(tables.calibrations)
        .scalar_subquery()
    )
    with_certificates = joined.outerjoin(tables.certificates, _Z.id == newest)
    return with_certificates.outerjoin(tables.certificate_withdrawals, _W.number == _Z.number)


def _served_in_force() -> sa.Select[*tuple[Any, ...]]:
    of = sa.and_(_X.serial == _C.serial, _X.version == _C.version)
    return (
        sa.select(_C.document, _C.hash, _X.id.label("act_id"), _X.id.label("last_id"), *_SERVED)
        .select_from(_with_certificate(tables.calibrations.join(tables.certifications, of)))
        .where(_X.id == _LAST, _X.act == "certify")
    )


@cache
def _served_together(*, is_shared: bool) -> sa.Select[*tuple[Any, ...]]:
    of = sa.and_(_X.serial == _C.serial, _X.version == _C.version)
    inner = tables.certifications.alias()
    last = (
        sa.select(sa.func.max(inner.c.id))
        .where(one_of_keys(inner.c.serial, is_shared=is_shared))
        .group_by(inner.c.serial)
    )
    return (
        sa.select(_C.serial, _C.document, _C.hash, _X.id.label("act_id"), _X.id.label("last_id"), *_SERVED)
        .select_from(_with_certificate(tables.calibrations.join(tables.certifications, of)))
        .where(_X.id.in_(last), _X.act == "certify")
    )


def _served_version() -> sa.Select[*tuple[Any, ...]]:
    inner = tables.certifications.alias()
    newest = (
        sa.select(sa.func.max(inner.c.id))
        .where(inner.c.serial == sa.bindparam("serial"), inner.c.version == sa.bindparam("version"))
        .scalar_subquery()
    )
    return (
        sa.select(_C.document, _C.hash, _X.id.label("act_id"), _LAST.label("last_id"), *_SERVED)
        .select_from(_with_certificate(tables.calibrations.outerjoin(tables.certifications, _X.id == newest)))
        .where(_C.serial == sa.bindparam("serial"), _C.version == sa.bindparam("version"))
    )


#: Built once: the queries behind every GET of a calibration.
_IN_FORCE, _VERSION = _served_in_force(), _served_version()


class Certifications:
    """Which versions are in force, and until when."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def served(self, serial: str, version: int | None) -> ServedCalibration | None:
        """Return a version, or the one in force, with the newest act on it; None where there is none: one query."""
        with self._database.reading() as connection:
            if version is None:
                row = connection.execute(_IN_FORCE, {"serial": serial}).first()
            else:
                row = connection.execute(_VERSION, {"serial": serial, "version": version}).first()
        return None if row is None else _served(serial, row)

    def lookup(self) -> Lookup:
        """Return the reads of versions in force by serial numbers, for `served_together`."""
        return self._database.lookup(_served_together(is_shared=self._database.is_shared))

    def in_force(self, serials: Sequence[str] | None = None) -> dict[str, CertificationRow]:
        """Return serial number -> the act that put its version in force, for every unit that has a version in force.

        With `serials` of those units alone.
        """
        last = sa.select(sa.func.max(_X.id)).group_by(_X.serial)
        query = sa.select(_X.serial, *_ACT).where(_X.id.in_(last), _X.act == "certify")
        some_of = sa.select(_X.serial, *_ACT).where(
            _X.id.in_(last.where(_X.serial.in_(sa.bindparam("serials", expanding=True)))), _X.act == "certify"
        )
        with self._database.reading() as connection:
            if serials is None:
                rows = list(connection.execute(query))
            else:
                rows = [row for some in parts_of(serials) for row in connection.execute(some_of, {"serials": some})]
        return {row.serial: _act(row.serial, row) for row in rows}

    def newest_versions(self, model: str | None = None) -> list[tuple[str, int]]:
        """Return serial number and version of each unit's newest act, also a revocation; of one model, or of all.

        They are in natural order.
        """
        u, last = tables.units.c, sa.select(sa.func.max(_X.id)).group_by(_X.serial)
        newest = sa.select(_X.serial, _X.version).where(_X.id.in_(last))
        query = newest.join(tables.units, u.serial == _X.serial).order_by(u.serial_key)
        if model is not None:
            query = query.where(u.model == model)
        with self._database.reading() as connection:
            return [(row.serial, row.version) for row in connection.execute(query)]

    def verdicts(self, serials: Sequence[str]) -> dict[str, str | None]:
        """Return serial number -> the verdict with which its version in force was certified, where one is in force."""
        last = sa.select(sa.func.max(_X.id)).where(_X.serial.in_(sa.bindparam("serials", expanding=True)))
        query = sa.select(_X.serial, _X.verdict).where(_X.id.in_(last.group_by(_X.serial)), _X.act == "certify")
        with self._database.reading() as connection:
            return {
                row.serial: row.verdict
                for some in parts_of(serials)
                for row in connection.execute(query, {"serials": some})
            }


async def served_together(lookup: Lookup, serials: Sequence[str]) -> dict[str, ServedCalibration]:
    """Return serial number -> the version in force, with the newest act on it, where there is one: one statement.

    `serials` are as many as one statement takes (`MAX_PARAMETERS`). Raises StoreError.
    """
    return {row.serial: _served(row.serial, row) for row in await lookup.rows(serials)}


def _served(serial: str, row: sa.Row[*tuple[Any, ...]]) -> ServedCalibration:
    act = None if row.act_id is None else _act(serial, row)
    in_force = act is not None and act.act == "certify" and row.act_id == row.last_id
    gone = None
    if row.w_by is not None:
        gone = Withdrawal(row.w_by, row.w_key, row.w_reason, row.w_at, row.w_act)
    document, hash_ = bytes(row.document), str(row.hash)
    return ServedCalibration(document, hash_, act, in_force, row.certificate, gone, row.act_id, row.judgement)


def _act(serial: str, row: sa.Row[*tuple[Any, ...]]) -> CertificationRow:
    return CertificationRow(serial, row.act_version, row.act, row.by, row.reason, row.at, row.due_at)
