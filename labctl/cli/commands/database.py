"""`labctl backup`, `labctl check`, `labctl migrate`: copying a database, checking it, and bringing it up to date."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr
from labctl.texts import counted

if TYPE_CHECKING:
    from labctl.answers.admin import CheckResponse


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
        console.print(f"{answer.file}: {answer.bytes} bytes, sha256 {answer.sha256}", soft_wrap=True)
        if answer.anchor:
            console.print(f"anchor of its manifests: {answer.anchor}", soft_wrap=True)
    if answer.remark:
        stderr.print(f"labctl: {answer.remark}")
    for finding in answer.findings:
        stderr.print(
            f"labctl: the copy is identical to the database, but the database is damaged: {finding.part}: "
            f"{finding.text}",
        )
    if answer.findings:
        raise typer.Exit(1)


def check(
    key: Annotated[
        list[Path] | None,
        typer.Option(
            "--key",
            metavar="PUBLIC.pem",
            help="Public key of the seal key; every manifest must then be covered by its signature. Repeat the option "
            "for keys that were used before.",
        ),
    ] = None,
    anchor: Annotated[
        str | None,
        typer.Option(
            "--anchor",
            metavar="LENGTH:HASH",
            help="Anchor that an earlier check or backup printed; the check fails if manifests up to it were changed.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Check the database for damage and for changes without labctl: file, schema, every reading, calibrations, audit
    trail, and each record against its manifest."""
    from labctl.services.admin.maintenance import check_database

    def said(part: str, done: int, total: int) -> None:
        status.update(f"{part} {done} of {total}" if total else part)

    with one_clear_line(), stderr.status("checking") as status:
        answer = check_database(database, None if as_json else said, anchor=anchor, keys=key or ())
    if as_json:
        print_json(answer)
    else:
        for finding in answer.findings:
            console.print(f"{finding.part}: {finding.text}", soft_wrap=True)
        for text in (*answer.remarks, *answer.kept_readings, *_of_manifests(answer)):
            console.print(text, soft_wrap=True)
        read = ((answer.blocks, "block"), (answer.calibrations, "calibration"), (answer.audit_rows, "audit row"))
        looked = ", ".join(counted(number, noun) for number, noun in read)
        verdict = "no damage found" if answer.ok else counted(len(answer.findings), "finding")
        console.print(f"{answer.database}: {looked}: {verdict}", soft_wrap=True)
    if not answer.ok:
        raise typer.Exit(1)


def _of_manifests(answer: CheckResponse) -> list[str]:
    """Return what was found of seals, in words."""
    if not answer.manifests:
        return []
    signed = "none signed"
    if answer.signed:
        text = "verified" if answer.verified else "not verified: give --key"
        signed = f"{answer.signed} signed by {', '.join(key[:16] for key in answer.keys)} ({text})"
    number = answer.not_sealed
    unsealed = f"; {number} record{'s are' if number > 1 else ' is'} not sealed yet" if number else ""
    return [f"{answer.manifests} manifests, {signed}{unsealed}; anchor {answer.anchor}"]


def move_database(
    source: Annotated[str, typer.Argument(metavar="FROM", help="Path or URL of the database to read.")],
    target: Annotated[str, typer.Argument(metavar="TO", help="Path of a new file, or URL of an empty database.")],
    as_json: Json = False,
) -> None:
    """Bring a database from SQLite to PostgreSQL or back; every row is compared, and an interrupted move goes on.

    The source stays as it is. End its service first; afterwards start services on the target.
    """
    from instruments.clock import SystemClock
    from labctl.services.admin.maintenance import move

    def said(table: str, done: int, total: int) -> None:
        status.update(f"{table} {done} of {total}" if total else table)

    with one_clear_line(), stderr.status("moving") as status:
        answer = move(source, target, SystemClock().utc(), None if as_json else said)
    if as_json:
        print_json(answer)
    else:
        earlier = f", {answer.kept} of them by an earlier move" if answer.kept else ""
        text = f"{answer.target}: {answer.rows} rows of {answer.tables} tables as in {answer.source}{earlier}"
        console.print(f"{text}; sha256 {answer.sha256}", soft_wrap=True)
        serve = f"labctl serve --database {quote(answer.target)}"
        console.print(f"next: `{serve}`; {answer.source} is not used any more", soft_wrap=True)
    for finding in answer.check.findings:
        stderr.print(f"labctl: {answer.target}: {finding.part}: {finding.text}")
    if answer.check.findings:
        raise typer.Exit(1)


def migrate(
    without_copy: Annotated[
        bool,
        typer.Option("--without-copy", help="Make no copy first; required for PostgreSQL, which pg_dump backs up."),
    ] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Bring a database of an earlier version to the schema of this one, after a verified copy beside the file."""
    from labctl.cli.printing.migration import migration_text
    from labctl.services.admin.maintenance import migrate as migrate_now

    with one_clear_line():
        answer = migrate_now(database, copy=not without_copy)
    if as_json:
        print_json(answer)
        return
    console.print(migration_text(answer), soft_wrap=True)
