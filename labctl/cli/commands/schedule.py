"""`labctl campaign schedule`: list, show, cancel. `labctl campaign start --at | --cron` enters a start."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table
from labctl.cli.printing.campaigns import print_start

if TYPE_CHECKING:
    pass

app = typer.Typer(no_args_is_help=True, help="Schedule: campaigns that a running service starts later.")

StartId = Annotated[int, typer.Argument(metavar="ID", help="Number of the scheduled start.")]


@app.command("list")
def list_(
    ended: Annotated[bool, typer.Option("--all", help="List starts that have ended as well.")] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List the scheduled starts, the next first. A start that was missed is listed until it is cancelled."""
    from labctl.services.benches.driving_process import driven_benches
    from labctl.services.commands.open import service_url
    from labctl.services.read_access import open_readonly
    from labctl.services.schedule.queue import list_starts

    with one_clear_line(), open_readonly(database) as store:
        answers = list_starts(store, ended=ended)
        waiting = {answer.bench for answer in answers if answer.due_at is not None}
        unserved = sorted(waiting - driven_benches(store)) if store.is_shared else []
        served = store.is_shared or service_url(database) is not None
    if as_json:
        print_json(answers)
        return
    rows = table("", "id", "recipe", "bench", "state", "next", "cron", "last start", "priority", numbers=1)
    for answer in answers:
        due = f"{answer.due_at:%Y-%m-%d %H:%M %z}" if answer.due_at else "–"
        last = f"{answer.history[-1].outcome}: {answer.history[-1].message}" if answer.history else "–"
        rows.add_row(
            str(answer.id), answer.recipe, answer.bench, answer.state, due, answer.cron or "–", last,
            str(answer.priority),
        )  # fmt: skip
    console.print(rows)
    for bench in unserved:
        stderr.print(
            f"no service drives bench {bench}, so no start that is scheduled there will begin; run `labctl serve "
            "--bench FILE`",
            style="yellow",
        )
    if answers and not served:
        stderr.print(
            "no service uses this database, so no scheduled start will begin; run `labctl serve`", style="yellow"
        )


@app.command("show")
def show(start: StartId, as_json: Json = False, database: Database = None) -> None:
    """Show when an entry begins next, and the outcome of each past start."""
    from labctl.services.read_access import open_readonly
    from labctl.services.schedule.queue import start_status

    with one_clear_line(), open_readonly(database) as store:
        answer = start_status(store, start)
    print_json(answer) if as_json else print_start(answer)


@app.command("cancel")
def cancel(start: StartId, as_json: Json = False, database: Database = None) -> None:
    """Remove an entry from the schedule. A campaign that it has started continues."""
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import CANCEL_START
    from labctl.services.commands.requests import ToStart

    with one_clear_line():
        answer = execute(database, CANCEL_START, ToStart(start))
    print_json(answer) if as_json else print_start(answer)
