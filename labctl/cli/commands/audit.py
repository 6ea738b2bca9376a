"""`labctl audit`: who did what, when and why."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table

app = typer.Typer(no_args_is_help=True, help="The audit trail: who did what, when and why.")


@app.command("list")
def list_(
    since: Annotated[
        datetime | None,
        typer.Option(
            "--since", help="List only rows written at or after this time (UTC): 2026-03-01 or 2026-03-01T08:00:00."
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List who did what, when and why."""
    from labctl.answers.admin import AuditResponse
    from labctl.services.admin.audit import list_audit
    from labctl.services.read_access import open_readonly

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
    console.print(rows)


@app.command("verify")
def verify(
    anchor: Annotated[
        str | None,
        typer.Option(
            "--anchor",
            metavar="LENGTH:HASH",
            help="Anchor that an earlier `labctl audit verify` printed, "
            "LENGTH:HASH; the check fails if rows up to the anchor were changed.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Verify the audit trail: find the first row that was changed or moved, or that follows a missing one."""
    from labctl.services.admin.audit import verify_audit
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = verify_audit(store, anchor)
    if as_json:
        print_json(answer)
    elif answer.ok:
        console.print(f"{answer.rows} rows, none changed; anchor {answer.anchor or 'none yet'}")
    else:
        stderr.print(f"labctl: audit trail: {answer.text}")
    if not answer.ok:
        raise typer.Exit(1)
