"""Keeping what was measured: checking a database, and backing it up while it is in use."""

from __future__ import annotations

from pathlib import Path

from labctl.config import default_database
from labctl.errors import LabctlError
from labctl.services.commands.local import open_commands
from labctl.services.commands.protocol import BackupNote
from labctl.services.schemas.answers import ResponseModel
from labctl.store import Progress, check, copy_database


class FindingResponse(ResponseModel):
    """Something that is not as it was written."""

    part: str
    text: str


class CheckResponse(ResponseModel):
    """What was looked at, and what was found."""

    ok: bool
    database: str
    blocks: int
    calibrations: int
    audit_rows: int
    findings: list[FindingResponse]


class BackupResponse(ResponseModel):
    """A backup that is on the disk."""

    file: str
    bytes: int
    sha256: str
    noted: bool
    remark: str = ""
    findings: list[FindingResponse]


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
