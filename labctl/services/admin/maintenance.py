"""Keeping what was measured: checking a database, and backing it up while it is in use."""

from __future__ import annotations

from pathlib import Path

from labctl.config import default_database
from labctl.errors import LabctlError
from labctl.services.commands.local import open_commands
from labctl.services.schemas.admin import BackupNote, BackupResponse, CheckResponse, FindingResponse
from labctl.store import Progress, check, copy_database


def check_database(database: str | None, progress: Progress | None = None) -> CheckResponse:
    """Look at all of a database: file, schema, readings, calibrations, audit trail. Raises StoreError without one."""
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


def back_up(database: str | None, target: Path, progress: Progress | None = None) -> BackupResponse:
    """Copy a database, also while a service or a campaign uses it, and check the copy.

    A copy in hand is worth more than a row about it: when nobody can write that row now, the copy stays and the answer
    says so. Raises BadInput, StoreError; then nothing is left of the copy.
    """
    made = copy_database(database or default_database(), target)
    note = BackupNote(file=target.name, bytes=made.bytes, sha256=made.sha256)
    remark = ""
    try:
        with open_commands(database) as commands:
            commands.note_backup(note)
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
