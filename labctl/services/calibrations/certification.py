"""Certification: which version of a calibration is in force, by whom and why."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Literal

from labctl.acting_user import actor
from labctl.services.schemas.calibrations import (
    CertificationResponse,
    CertifyRequest,
)
from labctl.store import CertificationRow, Store


def list_certifications(store: Store, serial: str) -> list[CertificationResponse]:
    """Return every act of certifying and revoking, newest first. Raises NotFound."""
    return [certification_response(row) for row in store.calibrations.history(store.units.get(serial).serial)]


def certification_response(row: CertificationRow) -> CertificationResponse:
    act: Literal["certify", "revoke"] = "certify" if row.act == "certify" else "revoke"
    return CertificationResponse(
        serial=row.serial, version=row.version, act=act, by=row.by, reason=row.reason, at=row.at, due=row.due_at
    )


def version_in_force(store: Store, serial: str) -> int | None:
    history = store.calibrations.history(serial)
    return history[0].version if history and history[0].act == "certify" else None


def certify(
    store: Store,
    serial: str,
    version: int,
    act: Literal["certify", "revoke"],
    request: CertifyRequest,
    at: datetime,
) -> CertificationResponse:
    """Put a version in force, or take it out of force. Raises NotFound, Conflict."""
    store.units.get(serial)
    due = at + timedelta(days=request.due_days) if request.due_days and act == "certify" else None
    door = actor()
    row = store.calibrations.certify(
        serial, version, act, by=request.by, reason=request.reason, at=at, due_at=due,
        who=door.name if door.via == "key" else request.by,
    )  # fmt: skip
    return CertificationResponse(serial=serial, version=version, act=act, by=row.by, reason=row.reason, at=at, due=due)
