"""`labctl key`: who may read, act and approve over HTTP."""

from __future__ import annotations

from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table

app = typer.Typer(
    no_args_is_help=True, help="API keys: they allow persons and programs to read, change or approve over HTTP."
)

KeyName = Annotated[str, typer.Argument(metavar="NAME", help="Name of the key's owner; the audit trail shows it.")]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Reason for this action; it is recorded.")]


@app.command("create")
def create(
    name: KeyName,
    role: Annotated[str, typer.Option("--role", metavar="ROLE", help="Role of the key: viewer, operator or approver.")],
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Make a key and print it once: only its digest is stored."""
    from labctl.answers.admin import KeyRequest, Role
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import CREATE_KEY

    with one_clear_line():
        answer = execute(database, CREATE_KEY, KeyRequest.model_validate({"name": name, "role": role}))
    if as_json:
        print_json(answer)
        return
    console.print(answer.key, soft_wrap=True)
    may = {
        Role.VIEWER: "read",
        Role.OPERATOR: "read, and make changes",
        Role.APPROVER: "read, make changes and approve",
    }[answer.role]
    stderr.print(f"{answer.name} may {may}. The key above is not shown again: store it now.")


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:
    """List every key that was made, by name; the keys themselves are not stored."""
    from labctl.services.admin.api_keys import list_keys
    from labctl.services.read_access import open_readonly

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


@app.command("revoke")
def revoke(
    name: KeyName, reason: Reason = "revoked from the command line", as_json: Json = False, database: Database = None
) -> None:
    """Revoke a key, at once."""
    from labctl.answers.campaigns import ReasonRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import REVOKE_KEY
    from labctl.services.commands.requests import ToKey

    with one_clear_line():
        answer = execute(database, REVOKE_KEY, ToKey(name, ReasonRequest(reason=reason)))
    print_json(answer) if as_json else console.print(f"{answer.name} is revoked")
