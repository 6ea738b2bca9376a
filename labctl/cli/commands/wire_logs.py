"""`labctl replay`: a recorded session again, on the recorded instruments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Json
from labctl.cli.output import console, print_json

if TYPE_CHECKING:
    from labctl.answers.wire_logs import ReadingsDigest, ReplayResponse


def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Wire log: a file that --wire-log wrote.")],
    as_json: Json = False,
    database: Annotated[
        str | None,
        typer.Option(
            "--database",
            metavar="URL_OR_PATH",
            help="Database that keeps the campaign of the replay; default: nothing is kept.",
        ),
    ] = None,
) -> None:
    """Do the session of a wire log again, in virtual time: the same requests get the recorded bytes; nothing moves.

    Exit 1 where labctl sends something else than in the session, or measures something else.
    """
    from labctl.services.wire_replay import replay as replay_log

    with one_clear_line():
        answer = replay_log(file, database)
    if as_json:
        print_json(answer)
    else:
        _print(answer)
    if not answer.ok:
        raise typer.Exit(1)


def _print(answer: ReplayResponse) -> None:
    end = "" if answer.whole else "; the log is truncated: the process that wrote it was killed, or still runs"
    lines = [
        f"{answer.session} on {answer.bench}, written by labctl {answer.labctl}: {answer.duration_s:.1f} s{end}",
        f"{answer.requests} requests were the same as in the session",
        answer.difference,
        *answer.remarks,
    ]
    if answer.found is not None and answer.found == answer.recorded:
        lines.append(f"{_readings(answer.found)}: equal to those of the session, bit for bit")
    elif answer.found is not None and answer.recorded is None:
        lines.append(f"{_readings(answer.found)}; those of the session are not in the log")
    for line in filter(None, lines):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def _readings(digest: ReadingsDigest) -> str:
    return f"{digest.readings} readings in {digest.datasets} data sets"
