"""`labctl key`, `audit`, `backup` and `check`: who may do what, who did what, and whether all of it is still there."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table

key_app = typer.Typer(no_args_is_help=True, help="API keys: who may read, act and approve over HTTP.")
audit_app = typer.Typer(no_args_is_help=True, help="The audit trail: who did what, when and why.")

KeyName = Annotated[str, typer.Argument(metavar="NAME", help="Whose key it is; the audit trail shows this name.")]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why.")]


@key_app.command("create")
def key_create(
    name: KeyName,
    role: Annotated[str, typer.Option("--role", metavar="ROLE", help="viewer, operator or approver.")],
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Make a key and print it, this once: only its digest is kept."""
    from labctl.services.commands.local import open_commands
    from labctl.services.schemas.admin import KeyRequest, Role

    with one_clear_line(), open_commands(database) as commands:
        answer = commands.create_key(KeyRequest.model_validate({"name": name, "role": role}))
    if as_json:
        print_json(answer)
        return
    console.print(answer.key, markup=False, soft_wrap=True)
    may = {Role.VIEWER: "read", Role.OPERATOR: "read and act", Role.APPROVER: "read, act and approve"}[answer.role]
    stderr.print(f"{answer.name} may {may}. The key is not shown again: keep it now.", markup=False)


@key_app.command("list")
def key_list(as_json: Json = False, database: Database = None) -> None:
    """List every key that was made, by name; the keys themselves are kept nowhere."""
    from labctl.services.admin.api_keys import list_keys
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answers = list_keys(store)
    if as_json:
        print_json(answers)
        return
    rows = table("", "name", "role", "made", "revoked")
    for answer in answers:
        revoked = f"{answer.revoked_at:%Y-%m-%d %H:%M}" if answer.revoked_at else "–"
        rows.add_row(answer.name, answer.role.value, f"{answer.created_at:%Y-%m-%d %H:%M}", revoked)
    console.print(rows)


@key_app.command("revoke")
def key_revoke(
    name: KeyName, reason: Reason = "revoked from the command line", as_json: Json = False, database: Database = None
) -> None:
    """Take a key's power away, at once."""
    from labctl.services.commands.local import open_commands

    with one_clear_line(), open_commands(database) as commands:
        answer = commands.revoke_key(name, reason)
    print_json(answer) if as_json else console.print(f"{answer.name} is revoked", markup=False)


@audit_app.command("list")
def audit_list(
    since: Annotated[
        datetime | None, typer.Option("--since", help="From this instant on, UTC: 2026-03-01 or 2026-03-01T08:00:00.")
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List who did what, when and why."""
    from labctl.services.admin.audit import list_audit
    from labctl.services.commands.open import open_readonly
    from labctl.services.schemas.admin import AuditResponse

    answers: list[AuditResponse] = []
    with one_clear_line(), open_readonly(database) as store:
        while page := list_audit(store, since, answers[-1].id if answers else 0):
            answers += page
    if as_json:
        print_json(answers)
        return
    rows = table("", "row", "when (UTC)", "who", "what", "to what", "why and how")
    for answer in answers:
        detail = ", ".join(f"{key} {value}" for key, value in answer.detail.items() if value is not None)
        when = f"{answer.at:%Y-%m-%d %H:%M:%S}"
        rows.add_row(str(answer.id), when, answer.who, answer.action, answer.subject, detail)
    console.print(rows, markup=False)


@audit_app.command("verify")
def audit_verify(
    anchor: Annotated[
        str | None,
        typer.Option("--anchor", metavar="LENGTH:HASH", help="What an earlier verify printed, kept elsewhere."),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Find the first row that was changed, moved, or follows a missing one."""
    from labctl.services.admin.audit import verify_audit
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = verify_audit(store, anchor)
    if as_json:
        print_json(answer)
    elif answer.ok:
        console.print(
            f"{answer.rows} rows, all as they were written; anchor {answer.anchor or 'none yet'}", markup=False
        )
    else:
        stderr.print(f"labctl: audit trail: {answer.text}", markup=False)
    if not answer.ok:
        raise typer.Exit(1)


def backup(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="New file; never written over an existing one.")],
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Copy the database to one file, also while a service or a campaign uses it, and check the copy."""
    from labctl.services.admin.maintenance import back_up

    with one_clear_line():
        answer = back_up(database, file)
    if as_json:
        print_json(answer)
    else:
        console.print(f"{answer.file}: {answer.bytes} bytes, sha256 {answer.sha256}", markup=False, soft_wrap=True)
    if answer.remark:
        stderr.print(f"labctl: {answer.remark}", markup=False)
    for finding in answer.findings:
        stderr.print(
            f"labctl: the copy is what the database was, and there: {finding.part}: {finding.text}", markup=False
        )
    if answer.findings:
        raise typer.Exit(1)


def check(as_json: Json = False, database: Database = None) -> None:
    """Check that all is as it was written: file, schema, every reading, calibrations, audit trail."""
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
        verdict = "all as it was written" if answer.ok else f"{number} finding{'s' if number > 1 else ''}"
        console.print(f"{answer.database}: {looked}: {verdict}", markup=False, soft_wrap=True)
    if not answer.ok:
        raise typer.Exit(1)
