"""The register of reference standards: certificates, intermediate checks and findings; rows are only ever added."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import date, datetime
from typing import Any, Literal

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.acting_user import acting_key
from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import STANDARD, STANDARD_CERTIFICATE, STANDARD_CHECK, STANDARD_FINDING
from labctl.store.repositories.audit import append
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


@dataclass(frozen=True)
class StandardRow:
    """A reference standard: artefact or instrument."""

    label: str
    serial: str
    quantity: str
    unit: str
    description: str
    by: str
    at: datetime


@dataclass(frozen=True)
class CertifiedPoint:
    """What a certificate states at one nominal, in the unit of the standard; None: no nominal, no value."""

    nominal: float | None
    value: float | None
    u: float
    k: float


@dataclass(frozen=True)
class StandardCertificate:
    """One certificate of a standard."""

    number: str
    laboratory: str
    calibrated: date
    due: date | None
    adjusted: bool
    traceability: str
    points: tuple[CertifiedPoint, ...]
    reason: str  #: why it replaces an earlier row of its number; empty: it is the first
    by: str
    at: datetime


@dataclass(frozen=True)
class StandardCheck:
    """One intermediate check of a standard."""

    checked_at: datetime
    nominal: float | None
    value: float
    u: float
    note: str
    by: str
    at: datetime


@dataclass(frozen=True)
class StandardFinding:
    """An act on the state of a standard: it was found bad, or such a finding is withdrawn."""

    id: int
    act: Literal["bad", "withdraw"]
    finding: int | None  #: that is withdrawn
    bad_from: date | None
    bad_until: date | None  #: None: still
    reason: str
    by: str
    at: datetime


@dataclass(frozen=True)
class RegisteredStandard:
    """A standard with all that is known of it, each list in the order in which it was written."""

    row: StandardRow
    certificates: tuple[StandardCertificate, ...] = ()
    checks: tuple[StandardCheck, ...] = ()
    findings: tuple[StandardFinding, ...] = ()

    @property
    def in_force(self) -> tuple[StandardCertificate, ...]:
        """The certificates by day. A row with a reason replaces one of its number, best one of its laboratory.

        A row without a reason is another certificate, also where another laboratory used the same number.
        """
        certificates: list[StandardCertificate] = []
        for certificate in self.certificates:
            alike = [one for one in certificates if one.number == certificate.number]
            if certificate.reason and alike:
                certificates.remove(next((one for one in alike if one.laboratory == certificate.laboratory), alike[-1]))
            certificates.append(certificate)
        return tuple(sorted(certificates, key=lambda certificate: certificate.calibrated))

    @property
    def bad(self) -> tuple[StandardFinding, ...]:
        """The findings that are not withdrawn."""
        withdrawn = {finding.finding for finding in self.findings if finding.act == "withdraw"}
        return tuple(finding for finding in self.findings if finding.act == "bad" and finding.id not in withdrawn)


def _day(text: str | None) -> date | None:
    return None if text is None else date.fromisoformat(text)


def _certificate(row: sa.Row[Any]) -> StandardCertificate:
    return StandardCertificate(
        row.number, row.laboratory, date.fromisoformat(row.calibrated), _day(row.due), bool(row.adjusted),
        row.traceability, tuple(CertifiedPoint(**point) for point in row.points), row.reason, row.by, row.at,
    )  # fmt: skip


def _check(row: sa.Row[Any]) -> StandardCheck:
    return StandardCheck(row.checked_at, row.nominal, row.value, row.u, row.note, row.by, row.at)


def _finding(row: sa.Row[Any]) -> StandardFinding:
    return StandardFinding(
        row.id, row.act, row.finding, _day(row.bad_from), _day(row.bad_until), row.reason, row.by, row.at
    )


class Standards:
    """The register of reference standards."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[RegisteredStandard]:
        """Return every standard, by label; one query where there is none."""
        with self._database.reading() as connection:
            return self._registered(connection, sa.true())

    def find(self, label: str) -> RegisteredStandard | None:
        """Return a standard by label or serial; None: it is not in the register."""
        s = tables.standards.c
        with self._database.reading() as connection:
            standards = self._registered(
                connection, sa.or_(s.label == label, sa.and_(s.serial == label, s.serial != ""))
            )
        return next(iter(sorted(standards, key=lambda standard: standard.row.label != label)), None)

    def get(self, label: str) -> RegisteredStandard:
        """Return a standard by label or serial. Raises NotFound."""
        if (standard := self.find(label)) is None:
            raise NotFound(
                f"standard {label!r} is not in the register; `labctl standards list` lists those that are, "
                "`labctl standards add` adds one"
            )
        return standard

    def has_findings(self) -> bool:
        """Return whether any standard was ever found bad: a point query before anything is compared."""
        return self.last_finding() > 0

    def last_finding(self) -> int:
        """Return the number of the last act on the state of any standard; 0: there was none."""
        with self._database.reading() as connection:
            return last_finding(connection)

    def _registered(self, connection: sa.Connection, which: sa.ColumnElement[bool]) -> list[RegisteredStandard]:
        rows = connection.execute(sa.select(tables.standards).where(which).order_by(tables.standards.c.label)).all()
        if not rows:
            return []
        numbers = [row.id for row in rows]

        def of(table: sa.Table, order: str = "id") -> dict[int, list[sa.Row[Any]]]:
            certificates: dict[int, list[sa.Row[Any]]] = {}
            query = sa.select(table).where(table.c.standard_id.in_(numbers)).order_by(table.c[order], table.c.id)
            for row in connection.execute(query):
                certificates.setdefault(row.standard_id, []).append(row)
            return certificates

        certificates, findings = of(tables.standard_certificates), of(tables.standard_findings)
        checks = of(tables.standard_checks, "checked_at")
        return [
            RegisteredStandard(
                StandardRow(row.label, row.serial, row.quantity, row.unit, row.description, row.by, row.at),
                tuple(_certificate(each) for each in certificates.get(row.id, ())),
                tuple(_check(each) for each in checks.get(row.id, ())),
                tuple(_finding(each) for each in findings.get(row.id, ())),
            )
            for row in rows
        ]

    @transaction
    def add(self, row: StandardRow) -> None:
        """Enter a standard. Raises Conflict for a label, or a serial number, that another one has."""
        duplicate = self.find(row.label) or (self.find(row.serial) if row.serial else None)
        if duplicate is not None:
            raise Conflict(_taken(duplicate.row, row))
        try:
            with self._database.writing() as connection:
                t = tables.standards
                number = connection.scalar(sa.insert(t).values(**asdict(row)).returning(t.c.id))
                detail = {"serial": row.serial, "quantity": row.quantity, "unit": row.unit}
                append(connection, row.at, "standard add", f"standard {row.label}", detail, who=acting_key() or row.by)
                seal(connection, (STANDARD.name, str(number)), row.at, "added")
        except exc.IntegrityError as error:
            raise Conflict(f"standard {row.label} was added by another request in the meantime; list it") from error

    @transaction
    def add_certificate(self, label: str, new: StandardCertificate) -> None:
        """Enter a certificate of a standard."""
        values: dict[str, Any] = {
            **{name: getattr(new, name) for name in ("number", "laboratory", "adjusted", "traceability", "reason")},
            "calibrated": new.calibrated.isoformat(), "due": None if new.due is None else new.due.isoformat(),
            "points": [asdict(point) for point in new.points],
        }  # fmt: skip
        self._add(label, tables.standard_certificates, STANDARD_CERTIFICATE.name, values, "certificate", new.by, new.at)

    @transaction
    def add_check(self, label: str, new: StandardCheck) -> None:
        """Enter an intermediate check of a standard."""
        values = {name: getattr(new, name) for name in ("nominal", "value", "u", "note")}
        audited = {**values, "checked_at": new.checked_at.isoformat()}
        stored = {**values, "checked_at": new.checked_at}
        self._add(label, tables.standard_checks, STANDARD_CHECK.name, stored, "check", new.by, new.at, audited)

    @transaction
    def add_finding(self, label: str, new: StandardFinding) -> int:
        """Enter that a standard was found bad, or that such a finding is withdrawn; returns its number.

        The number in `new` is not used.
        """
        values: dict[str, Any] = {
            "act": new.act, "finding": new.finding, "reason": new.reason,
            **{name: None if (day := getattr(new, name)) is None else day.isoformat()
               for name in ("bad_from", "bad_until")},
        }  # fmt: skip
        return self._add(label, tables.standard_findings, STANDARD_FINDING.name, values, new.act, new.by, new.at)

    def _add(
        self,
        label: str,
        table: sa.Table,
        kind: str,
        values: Mapping[str, Any],
        act: str,
        by: str,
        at: datetime,
        audited: Mapping[str, Any] | None = None,
    ) -> int:
        """Add a row of a standard with its audit row and its manifest; returns its number. Raises NotFound."""
        known_label = self.get(label).row.label
        with self._database.writing() as connection:
            s = tables.standards.c
            standard = connection.scalar(sa.select(s.id).where(s.label == known_label))
            row = sa.insert(table).values(standard_id=standard, by=by, at=at, **values).returning(table.c.id)
            number = int(connection.scalar(row) or 0)
            append(
                connection,
                at,
                f"standard {act}",
                f"standard {known_label}",
                dict(audited or values),
                who=acting_key() or by,
            )
            seal(connection, (kind, str(number)), at, act)
        return number


def last_finding(connection: sa.Connection) -> int:
    """Return the number of the last act on the state of any standard, as a transaction sees it; 0: there was none."""
    return int(connection.scalar(sa.select(sa.func.max(tables.standard_findings.c.id))) or 0)


def _taken(row: StandardRow, new: StandardRow) -> str:
    named = new.label if new.label in (row.label, row.serial) else new.serial
    return (
        f"{named!r} is already standard {row.label} of the register (serial number "
        f"{row.serial or 'not stated'}); give another label, or add certificates to that one"
    )
