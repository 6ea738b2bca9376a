"""`labctl verify`, `criticise`, `improve`, `ladder`: compare the model with the measurements, add what is missing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import AcceptWarnings, Database, Json, RecordingId, RecordingIds, Serial, recording_numbers
from labctl.cli.output import print_json
from labctl.cli.printing.criticism import (
    print_criticism,
    print_improvement,
    print_ladder,
    print_verification,
)
from labctl.cli.stage_line import stage_line

if TYPE_CHECKING:
    from labctl.fitting.effects import Formula

VersionOption = Annotated[
    int | None,
    typer.Option("--version", metavar="N", help="Number of the version; default: the unit's newest version."),
]
FormulaOption = Annotated[
    list[str] | None,
    typer.Option(
        "--formula",
        metavar="'NAME: EXPR'",
        help="Your own effect to include, as 'name: formula', or a TOML file of effects.",
    ),
]


OtherUnit = Annotated[bool, typer.Option("--other-unit", help="Accept a recording of another unit than SERIAL.")]


def verify(
    serial: Serial,
    version: VersionOption = None,
    recording: RecordingId = None,
    other_unit: OtherUnit = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Apply a version to a recording without refitting: its errors, and whether they are as small as expected."""
    from labctl.services.criticism.verification.of_version import verify_unit
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = verify_unit(store, serial, version, recording, other_unit=other_unit)
    if as_json:
        print_json(answer)
    else:
        print_verification(answer)
    if not answer.ok:
        raise typer.Exit(1)


def criticise(
    serial: Serial,
    version: VersionOption = None,
    recording: RecordingIds = None,
    other_unit: OtherUnit = False,
    formula: FormulaOption = None,
    next_recipe: Annotated[
        Path | None,
        typer.Option(
            "--next",
            metavar="FILE",
            help="Path of a recipe to write: the experiment that best distinguishes the suspected effects.",
        ),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", metavar="FILE", help="Path of a report to write: the verdict and the pictures in one HTML file."
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Compare a version with recordings: the residual, where it is large, and which effects may be missing."""
    from labctl.services.criticism.criticise import criticise_unit, write_next
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        competing = written(formula)
        with stage_line():
            answer = criticise_unit(
                store, serial, version, None, competing, recordings=recording_numbers(recording), other_unit=other_unit
            )
        if next_recipe is not None:
            write_next(answer, next_recipe)
        if report is not None:
            from labctl.services.criticism.report import write_report

            write_report(store, answer, report)
    if as_json:
        print_json(answer)
    else:
        print_criticism(answer)
    if answer.verdict == "insufficient_data":
        raise typer.Exit(1)


def written(sources: list[str] | None) -> list[Formula]:
    """Return the formulas of a command line. Raises BadInput."""
    if not sources:
        return []
    from labctl.services.effects import with_files

    return with_files(sources)


def improve(
    serial: Serial,
    add: Annotated[
        list[str] | None,
        typer.Option("--add", metavar="EFFECT", help="Effect to add; `name@parameter=value` in this shape."),
    ] = None,
    remove: Annotated[list[str] | None, typer.Option("--remove", metavar="EFFECT", help="Effect to remove.")] = None,
    formula: FormulaOption = None,
    version: VersionOption = None,
    recording: RecordingIds = None,
    accept_warnings: AcceptWarnings = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Change a version's effects and fit again: a new version, with the error before and after."""
    from labctl.answers.calibrations import ImproveRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import IMPROVE
    from labctl.services.commands.requests import ToNewestOrVersion
    from labctl.services.effects import as_lines

    def names(values: list[str] | None) -> list[str]:
        return [name.strip() for text in values or [] for name in text.split(",") if name.strip()]

    with one_clear_line():
        request = ImproveRequest(
            add=names(add), remove=names(remove), formula=as_lines(formula or []),
            recordings=recording_numbers(recording), accept_warnings=accept_warnings,
        )  # fmt: skip
        answer = execute(database, IMPROVE, ToNewestOrVersion(serial, version, request))
    if as_json:
        print_json(answer)
    else:
        print_improvement(answer)


def ladder(
    serial: Serial,
    recording: Annotated[
        int | None,
        typer.Option(
            "--recording",
            metavar="ID",
            help="Number of the recording whose versions are listed; default: "
            "the recording that the newest version was fitted to.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show the errors of the versions on one recording, each after the version it was changed from, and the noise
    floor."""
    from labctl.services.criticism.ladder import ladder as ladder_of
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = ladder_of(store, serial, recording)
    if as_json:
        print_json(answer)
    else:
        print_ladder(answer)
