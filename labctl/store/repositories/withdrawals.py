"""Withdrawals of certificates: of one by its number, or of all of a version that is revoked. They are never undone."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa

from instruments.clock import SystemClock
from labctl.store.manifests import chain
from labctl.store.manifests.contents import WITHDRAWAL
from labctl.store.records import Withdrawal
from labctl.store.repositories.audit import append
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


def withdraw(
    connection: sa.Connection, number: str, withdrawal: Withdrawal, sealed_at: datetime, reason: str = "withdrawn"
) -> None:
    """Withdraw a certificate that is not withdrawn yet, inside a transaction; `reason` is that of its manifest."""
    w = tables.certificate_withdrawals
    withdrawal_id = connection.scalar(
        sa.insert(w).values(
            number=number, by=withdrawal.by, by_key=withdrawal.by_key, reason=withdrawal.reason, at=withdrawal.at,
            certification_id=withdrawal.act,
        ).returning(w.c.id)
    )  # fmt: skip
    seal(connection, (WITHDRAWAL.name, str(withdrawal_id)), sealed_at, reason)


def withdraw_of_version(connection: sa.Connection, serial: str, version: int, withdrawal: Withdrawal) -> list[str]:
    """Withdraw every certificate of a version that is not withdrawn; returns their numbers, oldest first."""
    certificates = _standing(connection, serial, version)
    for number in certificates:
        withdraw(connection, number, withdrawal, withdrawal.at)
        detail = {"number": number, "reason": withdrawal.reason, "by": withdrawal.by, "revoked": True}
        append(
            connection,
            withdrawal.at,
            "certificate withdraw",
            f"{serial} version {version}",
            detail,
            who=withdrawal.by_key or withdrawal.by,
        )
    return certificates


def _standing(connection: sa.Connection, serial: str, version: int, issued_until: datetime | None = None) -> list[str]:
    c, w = tables.certificates.c, tables.certificate_withdrawals.c
    query = sa.select(c.number).where(
        c.serial == serial, c.version == version, c.number.not_in(sa.select(w.number)),
        *(() if issued_until is None else (c.at <= issued_until,)),
    )  # fmt: skip
    return list(connection.scalars(query.order_by(c.id)))


def withdraw_of_revocations(connection: sa.Connection) -> None:
    """Withdraw the certificates of versions that were revoked when no withdrawals were kept: of migration 0019."""
    sealed_at = SystemClock().utc()
    reason = f"withdrawn by migration on {sealed_at:%Y-%m-%d}"
    x = tables.certifications.c
    revoked = sa.select(x.id, x.serial, x.version, x.by, x.reason, x.at).where(x.act == "revoke").order_by(x.id)
    chain.begin(connection)
    for row in connection.execute(revoked).all():
        withdrawal = Withdrawal(row.by, None, row.reason, row.at, int(row.id))
        for number in _standing(connection, row.serial, row.version, row.at):
            withdraw(connection, number, withdrawal, sealed_at, reason)
    chain.finish(connection)
