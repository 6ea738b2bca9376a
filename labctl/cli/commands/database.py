"""`labctl backup` and `labctl check`: copying a database, and checking that all is as it was written."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr


def backup(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Path of the backup to write; an existing file is never overwritten.")
    ],
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Copy the database to one file and check the copy; also while a service or a campaign uses the database."""
    from labctl.services.admin.maintenance import back_up
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import NOTE_BACKUP

    with one_clear_line():
        answer = back_up(database, file, lambda note: execute(database, NOTE_BACKUP, note))
    if as_json:
        print_json(answer)
    else:
        console.print(f"{answer.file}: {answer.bytes} bytes, sha256 {answer.sha256}", markup=False, soft_wrap=True)
    if answer.remark:
        stderr.print(f"labctl: {answer.remark}", markup=False)
    for finding in answer.findings:
        stderr.print(
            f"labctl: the copy is identical to the database, but the database is damaged: {finding.part}: "
            f"{finding.text}",
            markup=False,
        )
    if answer.findings:
        raise typer.Exit(1)


def check(as_json: Json = False, database: Database = None) -> None:
    """Check the database for damage: file, schema, every reading, calibrations, audit trail."""
    from labctl.services.admin.maintenance import check_database

    def said(part: str, done: int, total: int) -> None:
        status.update(f"{part} {done} of {total}" if total else part)

    with one_clear_line(), stderr.status("checking") as status:
        answer = check_database(database, None if as_json else said)
    if as_json:
        print_json(answer)
    else:
        for finding in answer.findings:
            console.print(f"{finding.part}: {finding.text}", markup=False, soft_wrap=True)
        looked = f"{answer.blocks} blocks, {answer.calibrations} calibrations, {answer.audit_rows} audit rows"
        number = len(answer.findings)
        verdict = "no damage found" if answer.ok else f"{number} finding{'s' if number > 1 else ''}"
        console.print(f"{answer.database}: {looked}: {verdict}", markup=False, soft_wrap=True)
    if not answer.ok:
        raise typer.Exit(1)
