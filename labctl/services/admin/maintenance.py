"""Maintenance of a database: checking it, and backing it up while it is in use."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from labctl.config import default_database
from labctl.errors import LabctlError
from labctl.services.schemas.admin import BackupNote, BackupResponse, CheckResponse, FindingResponse
from labctl.store import Progress, check, copy_database


def check_database(database: str | None, progress: Progress | None = None) -> CheckResponse:
    """Check all of a database: file, schema, readings, calibrations, audit trail. Raises StoreError without one."""
    location = database or default_database()
    found = check(location, progress=progress)
    return CheckResponse(
        ok=not found.findings,
        database=location,
        blocks=found.blocks,
        calibrations=found.calibrations,
        audit_rows=found.audit_rows,
        findings=[FindingResponse(part=each.part, text=each.text) for each in found.findings],
    )


def back_up(
    database: str | None, target: Path, note: Callable[[BackupNote], object], progress: Progress | None = None
) -> BackupResponse:
    """Copy a database, also while a service or a campaign uses it, and check the copy.

    `note` records the backup in the audit trail. When that is impossible now, the copy stays and the
    response says so. Raises BadInput, StoreError; then nothing is left of the copy.
    """
    made = copy_database(database or default_database(), target)
    remark = ""
    try:
        note(BackupNote(file=target.name, bytes=made.bytes, sha256=made.sha256))
    except LabctlError as error:
        remark = f"the backup is made, but could not be noted in the audit trail: {error}"
    return BackupResponse(
        file=str(target),
        bytes=made.bytes,
        sha256=made.sha256,
        noted=not remark,
        remark=remark,
        findings=check_database(str(target), progress).findings,
    )
