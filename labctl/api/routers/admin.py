"""API keys, the audit trail, and notes of backups: administration."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query

from labctl.answers.admin import AuditResponse, BackupNote, KeyRequest, KeyResponse, NewKeyResponse
from labctl.answers.campaigns import ReasonRequest
from labctl.api.access_policy import NEEDS_APPROVER
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.admin.api_keys import list_keys
from labctl.services.admin.audit import list_audit
from labctl.services.commands.registry import CREATE_KEY, NOTE_BACKUP, REVOKE_KEY
from labctl.services.commands.requests import ToKey

router = APIRouter(prefix="/api", tags=["keys and audit"])


@router.get("/keys", summary="All keys", dependencies=[NEEDS_APPROVER])
def keys(service: ServiceDep) -> list[KeyResponse]:
    """Every key that was made, with its role; the keys themselves are not stored. Needs an approver's key."""
    return list_keys(service.store)


@command_route(router, CREATE_KEY, "Make a key", dependencies=[NEEDS_APPROVER])
def create_key(request: KeyRequest, service: ServiceDep) -> NewKeyResponse:
    """Make a key. The answer is the only place where it is ever shown. Needs an approver's key."""
    return service.execute(CREATE_KEY, request)


@command_route(router, REVOKE_KEY, "Revoke a key", dependencies=[NEEDS_APPROVER])
def revoke_key(name: str, request: ReasonRequest, service: ServiceDep) -> KeyResponse:
    """Revoke a key, at once. Needs an approver's key."""
    return service.execute(REVOKE_KEY, ToKey(name, request))


@router.get("/audit", summary="The audit trail")
def audit(
    service: ServiceDep,
    since: Annotated[
        datetime | None,
        Query(description="Only rows written at or after this time (ISO 8601; UTC if no time zone is given)."),
    ] = None,
    after: Annotated[
        int, Query(ge=0, le=2**63 - 1, description="Only rows with a number larger than this number.")
    ] = 0,
    limit: Annotated[int, Query(ge=1, le=10_000, description="Largest number of rows in the response.")] = 1000,
) -> list[AuditResponse]:
    """Who did what, when and why, in order; each row's hash covers it and the row before."""
    return list_audit(service.store, since, after, limit)


@command_route(router, NOTE_BACKUP, "Note a backup")
def note_backup(note: BackupNote, service: ServiceDep) -> None:
    """Record in the audit trail that a backup was made; `labctl backup` sends it."""
    service.execute(NOTE_BACKUP, note)
