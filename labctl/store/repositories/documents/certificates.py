"""Certificates: kept as they were issued; an amended one has a row of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.errors import Conflict
from labctl.json_types import JsonDocument
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import CERTIFICATE
from labctl.store.repositories.audit import append
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
    signed_by: JsonDocument | None = None  #: who signed PDF and DCC, as the document says; None: no signature


@dataclass(frozen=True)
class CertificateForms:
    """The forms of a certificate, as they were issued."""

    document: bytes
    xml: bytes
    pdf: bytes


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
    def add(self, row: CertificateRow, forms: CertificateForms) -> CertificateRow:
        """Keep a certificate that is issued now.

        Raises Conflict where another one took its number, or replaces the same one; nothing was changed.
        """
        values = {
            "number": row.number, "serial": row.serial, "version": row.version, "replaces": row.replaces,
            "reason": row.reason, "by": row.by, "at": row.at, "hash": row.hash, "order": dict(row.order),
            "document": forms.document, "xml": forms.xml, "pdf": forms.pdf,
        }  # fmt: skip
        detail: dict[str, Any] = {
            "number": row.number, "hash": row.hash, "replaces": row.replaces, "reason": row.reason, "by": row.by,
        }  # fmt: skip
        try:
            with self._database.writing() as connection:
                c = tables.certificates.c
                number = connection.scalar(sa.insert(tables.certificates).values(**values).returning(c.id))
                append(connection, row.at, "certificate", f"{row.serial} version {row.version}", detail, who=row.by)
                seal(connection, (CERTIFICATE.name, str(number)), row.at, "issued")
        except exc.IntegrityError as error:
            raise Conflict(
                f"certificate {row.number} of {row.serial} was issued by another request in the meantime; send this "
                "one again"
            ) from error
        return row

    def of_unit(self, serial: str) -> list[CertificateRow]:
        """Return every certificate of a unit, newest first."""
        c = tables.certificates.c
        with self._database.reading() as connection:
            return [_row(row) for row in connection.execute(_ROWS.where(c.serial == serial).order_by(c.id.desc()))]

    def of_number(self, number: str) -> CertificateRow | None:
        """Return the certificate of a number; None: none has it."""
        with self._database.reading() as connection:
            row = connection.execute(_ROWS.where(tables.certificates.c.number == number)).first()
        return None if row is None else _row(row)

    def newest(self, serial: str, version: int) -> CertificateRow | None:
        """Return the certificate of a version that none replaces; None: none was issued."""
        return next((row for row in self.of_unit(serial) if row.version == version), None)

    def forms(self, number: str) -> CertificateForms:
        """Return the forms of a certificate that is there."""
        c = tables.certificates.c
        with self._database.reading() as connection:
            row = connection.execute(sa.select(c.document, c.xml, c.pdf).where(c.number == number)).one()
        return CertificateForms(bytes(row.document), bytes(row.xml), bytes(row.pdf))


_C = tables.certificates.c
_ROWS = sa.select(
    _C.number, _C.serial, _C.version, _C.replaces, _C.reason, _C.by, _C.at, _C.hash, _C.order, _C.document
)  # fmt: skip


def _row(found: sa.Row[*tuple[Any, ...]]) -> CertificateRow:
    number, serial, version, replaces, reason, by, at, digest, order, document = found
    signed_by = json.loads(bytes(document)).get("signed_by")
    return CertificateRow(number, serial, version, replaces, reason, by, at, digest, order, signed_by)
