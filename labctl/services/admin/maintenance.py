"""Maintenance of a database: checking it, and backing it up while it is in use."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

from labctl.answers.admin import (
    BackupNote,
    BackupResponse,
    CheckResponse,
    DamageResponse,
    MigrationResponse,
    MoveResponse,
)
from labctl.config import default_database
from labctl.errors import BadInput, LabctlError
from labctl.services.recordings.live_folders import kept_beside
from labctl.store import (
    ChainHead,
    Progress,
    check,
    copy_database,
    is_url,
    migrate_database,
    move_database,
    needs_migration,
    open_store,
    parse_anchor,
    read_public_key,
    shown,
)


def check_database(
    database: str | None,
    progress: Progress | None = None,
    *,
    anchor: str | None = None,
    keys: Sequence[Path] = (),
) -> CheckResponse:
    """Check all of a database: file, schema, readings, calibrations, audit trail, manifests.

    `anchor` is LENGTH:HASH of the manifests as an earlier check or backup printed it; `keys` are files of public keys.
    Raises StoreError without a database, BadInput for an anchor or a key that cannot be read.
    """
    location = database or default_database()
    chain_anchor = None if anchor is None else _anchor(anchor)
    checked = check(
        location, chain_anchor=chain_anchor, keys=[read_public_key(path) for path in keys], progress=progress
    )
    return CheckResponse(
        ok=not checked.findings,
        database=location,
        blocks=checked.blocks,
        calibrations=checked.calibrations,
        audit_rows=checked.audit_rows,
        manifests=checked.manifests,
        not_sealed=checked.not_sealed,
        signed=checked.signed,
        verified=bool(keys),
        keys=list(checked.keys),
        anchor=None if checked.head is None else str(checked.head),
        remarks=list(checked.remarks),
        kept_readings=[each.text for each in kept_beside(location)],
        findings=[DamageResponse(part=each.part, text=each.text) for each in checked.findings],
    )


def _anchor(text: str) -> ChainHead:
    try:
        return parse_anchor(text)
    except ValueError as error:
        raise BadInput(f"--anchor {text!r}: expected LENGTH:HASH as `labctl check` prints it") from error


def migrate(database: str | None, *, copy: bool = True) -> MigrationResponse:
    """Migrate a database to the present schema after copying it. Raises BadInput, StoreError, Conflict."""
    location = database or default_database()
    done = migrate_database(location, copy=copy)
    return MigrationResponse(
        database=shown(location),
        from_schema=done.before,
        to_schema=done.after,
        copied_to=None if done.copy is None else str(done.copy.path),
        bytes=None if done.copy is None else done.copy.bytes,
        sha256=None if done.copy is None else done.copy.sha256,
    )


def move(source: str, target: str, at: datetime, progress: Progress | None = None) -> MoveResponse:
    """Bring a database into another one, compare every row, check the new one, and enter the move into its audit trail.

    Raises BadInput, Conflict, OldSchema, StoreError.
    """
    moved = move_database(source, target, progress or (lambda *_: None))
    with open_store(target, write=True) as store:
        detail = {"from": shown(source), "rows": moved.rows, "sha256": moved.sha256}
        store.audit.record(at, "database move", shown(target), detail)
    return MoveResponse(
        source=shown(source), target=shown(target), tables=moved.tables, rows=moved.rows, kept=moved.kept,
        sha256=moved.sha256, check=check_database(target),
    )  # fmt: skip


def migrate_before_service(location: str) -> MigrationResponse | None:
    """Migrate a file of an earlier version, after a copy; None where there is nothing to do.

    A server's database is left to `labctl migrate --without-copy`: opening it says so. Raises BadInput, StoreError.
    """
    if is_url(location) or not needs_migration(location):
        return None
    return migrate(location)


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
    checked = check_database(str(target), progress)
    return BackupResponse(
        file=str(target),
        bytes=made.bytes,
        sha256=made.sha256,
        noted=not remark,
        remark=remark,
        anchor=checked.anchor,
        findings=checked.findings,
    )
