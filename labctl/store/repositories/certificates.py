"""Certificates: kept as they were issued; an amended one has a row of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.answers.json_object import JsonDocument
from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import CERTIFICATE
from labctl.store.records import Withdrawal
from labctl.store.repositories.audit import append
from labctl.store.repositories.standards import last_finding
from labctl.store.repositories.withdrawals import withdraw
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


@dataclass(frozen=True)
class CertificateRow:
    """One certificate, without its three forms."""

    number: str
    serial: str
    version: int
    replaces: str | None
    reason: str
    by: str
    at: datetime
    hash: str
    order: JsonDocument
    by_key: str | None = None  #: name of the API key that issued it; None: `by` is as typed
    withdrawal: Withdrawal | None = None
    signed_by: JsonDocument | None = None  #: who signed PDF and DCC, as the document says; None: no signature


@dataclass(frozen=True)
class CertificateForms:
    """The forms of a certificate, as they were issued."""

    document: bytes
    xml: bytes
    pdf: bytes


_C, _W = tables.certificates.c, tables.certificate_withdrawals.c
_WITHDRAWAL = (_W.by, _W.by_key, _W.reason, _W.at, _W.certification_id)


def _withdrawal(row: sa.RowMapping) -> Withdrawal | None:
    if row[_W.by] is None:
        return None
    return Withdrawal(
        by=row[_W.by], by_key=row[_W.by_key], reason=row[_W.reason], at=row[_W.at], act=row[_W.certification_id]
    )


class Certificates:
    """Every certificate of every unit."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def count_of_year(self, year: int, prefix: str) -> int:
        """Return how many certificates have a number that begins with `prefix` and the year."""
        c = tables.certificates.c
        begins = c.number.startswith(f"{prefix}{year:04d}-", autoescape=True)
        with self._database.reading() as connection:
            return int(connection.scalar(sa.select(sa.func.count()).where(begins)) or 0)

    @transaction
    def add(self, row: CertificateRow, forms: CertificateForms, finding: int | None = None) -> CertificateRow:
        """Keep a certificate that is issued now.

        `finding` is the last act on the state of a standard when its evidence was read; None: it rests on no standard.
        Raises Conflict where another certificate took its number, or replaces the same one, and where a standard was
        found bad since; nothing was changed.
        """
        values = {
            "number": row.number, "serial": row.serial, "version": row.version, "replaces": row.replaces,
            "reason": row.reason, "by": row.by, "at": row.at, "hash": row.hash, "order": dict(row.order),
            "document": forms.document, "xml": forms.xml, "pdf": forms.pdf, "by_key": row.by_key,
        }  # fmt: skip
        detail: dict[str, Any] = {
            "number": row.number, "hash": row.hash, "replaces": row.replaces, "reason": row.reason, "by": row.by,
        }  # fmt: skip
        try:
            with self._database.writing() as connection:
                c = tables.certificates.c
                number = connection.scalar(sa.insert(tables.certificates).values(**values).returning(c.id))
                append(
                    connection,
                    row.at,
                    "certificate",
                    f"{row.serial} version {row.version}",
                    detail,
                    who=row.by_key or row.by,
                )  # from here on no other act is written
                if finding is not None and last_finding(connection) != finding:
                    raise Conflict(
                        f"no certificate of {row.serial} version {row.version} was stored: while it was being written, "
                        "a reference standard was found bad, or such a finding was withdrawn; send the request again "
                        "(`labctl standards list` shows the standards)"
                    )
                seal(connection, (CERTIFICATE.name, str(number)), row.at, "issued")
        except exc.IntegrityError as error:
            raise Conflict(
                f"certificate {row.number} of {row.serial} was issued by another request in the meantime; send this "
                "one again"
            ) from error
        return row

    @transaction
    def withdraw(self, number: str, withdrawal: Withdrawal) -> CertificateRow:
        """Withdraw one certificate; its version stays in force. Raises NotFound, Conflict where it is withdrawn."""
        row = self.get(number)
        again = Conflict(
            f"certificate {number} is withdrawn already; `labctl certificates {row.serial}` gives the reason"
        )
        if row.withdrawal is not None:
            raise again
        detail: dict[str, Any] = {"number": number, "reason": withdrawal.reason, "by": withdrawal.by}
        try:
            with self._database.writing() as connection:
                subject = f"{row.serial} version {row.version}"
                append(
                    connection,
                    withdrawal.at,
                    "certificate withdraw",
                    subject,
                    detail,
                    who=withdrawal.by_key or withdrawal.by,
                )
                x = tables.certifications.c
                last = sa.select(sa.func.max(x.id)).where(x.serial == row.serial, x.version == row.version)
                withdrawal = replace(withdrawal, act=connection.scalar(last))
                withdraw(connection, number, withdrawal, withdrawal.at)
        except exc.IntegrityError as error:
            raise again from error
        return replace(row, withdrawal=withdrawal)

    def of_unit(self, serial: str) -> list[CertificateRow]:
        """Return every certificate of a unit, newest first."""
        return self._rows(tables.certificates.c.serial == serial)

    def of_number(self, number: str) -> CertificateRow | None:
        """Return the certificate of a number; None: none has it."""
        return next(iter(self._rows(tables.certificates.c.number == number)), None)

    def get(self, number: str) -> CertificateRow:
        """Return a certificate by its number. Raises NotFound."""
        if (row := self.of_number(number)) is None:
            raise NotFound(
                f"there is no certificate {number!r} in this database; `labctl certificates SERIAL` lists those of a "
                "unit"
            )
        return row

    def _rows(self, which: sa.ColumnElement[bool]) -> list[CertificateRow]:
        c, w = tables.certificates.c, tables.certificate_withdrawals.c
        joined = tables.certificates.outerjoin(tables.certificate_withdrawals, w.number == c.number)
        columns = (c.number, c.serial, c.version, c.replaces, c.reason, c.by, c.at, c.hash, c.order, c.by_key)
        query = sa.select(*columns, c.document, *_WITHDRAWAL).select_from(joined).where(which).order_by(c.id.desc())
        with self._database.reading() as connection:
            return [_row(row) for row in connection.execute(query).mappings()]

    def newest(self, serial: str, version: int) -> CertificateRow | None:
        """Return the certificate of a version that none replaces; None: none was issued."""
        return next((row for row in self.of_unit(serial) if row.version == version), None)

    def forms(self, number: str) -> CertificateForms:
        """Return the forms of a certificate that is there."""
        c = tables.certificates.c
        with self._database.reading() as connection:
            row = connection.execute(sa.select(c.document, c.xml, c.pdf).where(c.number == number)).one()
        return CertificateForms(bytes(row.document), bytes(row.xml), bytes(row.pdf))


def _row(row: sa.RowMapping) -> CertificateRow:
    signed_by = json.loads(bytes(row[_C.document])).get("signed_by")
    return CertificateRow(
        number=row[_C.number], serial=row[_C.serial], version=row[_C.version], replaces=row[_C.replaces],
        reason=row[_C.reason], by=row[_C.by], at=row[_C.at], hash=row[_C.hash], order=row[_C.order],
        by_key=row[_C.by_key], withdrawal=_withdrawal(row), signed_by=signed_by,
    )  # fmt: skip
