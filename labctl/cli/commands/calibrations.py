"""`labctl fit`, `certify`, `revoke`, `certifications`, `calibration`, `compensate`: up to a corrected rate."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import AcceptWarnings, Database, FormatOptions, Json, RecordingIds, Serial, recording_numbers
from labctl.cli.output import console, print_json, stderr

Version = Annotated[int, typer.Argument(metavar="VERSION", help="Calibration version of the unit: 1, 2, 3 ...")]
By = Annotated[str, typer.Option("--by", metavar="NAME", help="Name of the person who does this; it is recorded.")]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Reason for this action; it is recorded.")]
Override = Annotated[
    bool,
    typer.Option("--override", help="Certify although there are objections; the reason must then be a sentence."),
]
FixedFile = Annotated[
    Path | None,
    typer.Option(
        "--fixed",
        metavar="FILE",
        help="Hold the coefficients in FILE at their values and fit the others; FILE is TOML (a table for each "
        "axis) or a calibration file.",
    ),
]
TypePrior = Annotated[
    bool,
    typer.Option(
        "--type-prior",
        help="Add what the other calibrated units of the unit's type say of its coefficients; the version says so.",
    ),
]


def fit(
    serial: Serial,
    recording: RecordingIds = None,
    model: Annotated[
        str | None, typer.Option("--model", metavar="NAME", help="Name of a model; `labctl effects` lists the models.")
    ] = None,
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            metavar="A,B,C",
            help="Ids of the effects of the model, or with --model of effects to add to it; `name:2` sets the "
            "polynomial order to 2.",
        ),
    ] = None,
    fixed: FixedFile = None,
    type_prior: TypePrior = False,
    accept_warnings: AcceptWarnings = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Fit a model to a recording, or to several together; it becomes the unit's next calibration version."""
    from labctl.answers.calibrations import FitRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import FIT
    from labctl.services.commands.requests import ToUnit

    names = [name.strip() for name in effects.split(",") if name.strip()] if effects else []
    with one_clear_line():
        request = FitRequest(
            recordings=recording_numbers(recording), model=model, effects=names, type_prior=type_prior,
            accept_warnings=accept_warnings,
        )  # fmt: skip
        if fixed is not None:
            from labctl.services.fixed_coefficients import read_fixed

            request = request.model_copy(update={"fixed": read_fixed(fixed)})
        answer = execute(database, FIT, ToUnit(serial, request))
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.calibrations import print_fit

        print_fit(answer)


def certify(
    serial: Serial,
    version: Version,
    by: By,
    reason: Reason,
    due_days: Annotated[
        int | None,
        typer.Option(
            "--due-days",
            metavar="N",
            help="Days until the next calibration is due; 0: no due date; default: the number in the recipe, "
            "else $LABCTL_DUE_DAYS.",
        ),
    ] = None,
    override: Override = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Certify a version: put it in force. Certifying an older version again is a rollback.

    Refused where its verdict, its errors or its data give objections, unless --override. With
    $LABCTL_TWO_PERSON_RELEASE = 1, the version is in force once a second person has released it.
    """
    from labctl.answers.certification import CertifyRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import CERTIFY
    from labctl.services.commands.requests import ToVersion

    with one_clear_line():
        request = CertifyRequest(by=by, reason=reason, due_days=due_days, override=override)
        answer = execute(database, CERTIFY, ToVersion(serial, version, request))
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.calibrations import print_certification

        print_certification(answer)


def release(
    serial: Serial, version: Version, by: By, reason: Reason, as_json: Json = False, database: Database = None
) -> None:
    """Release a version as the second person, with another API key than the first: it is in force then."""
    from labctl.answers.certification import ReleaseRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import RELEASE
    from labctl.services.commands.requests import ToVersion

    with one_clear_line():
        answer = execute(database, RELEASE, ToVersion(serial, version, ReleaseRequest(by=by, reason=reason)))
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.calibrations import print_certification

        print_certification(answer)


def revoke(
    serial: Serial, version: Version, by: By, reason: Reason, as_json: Json = False, database: Database = None
) -> None:
    """Revoke the certification of a version; its certificates are withdrawn, and who fetched it is listed."""
    from labctl.answers.certification import RevokeRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import REVOKE
    from labctl.services.commands.requests import ToVersion

    with one_clear_line():
        answer = execute(database, REVOKE, ToVersion(serial, version, RevokeRequest(by=by, reason=reason)))
    if as_json:
        print_json(answer)
    else:
        from labctl.cli.printing.calibrations import print_certification

        print_certification(answer)


def certifications(serial: Serial, as_json: Json = False, database: Database = None) -> None:
    """List what was certified and revoked, newest first, with the verdict at that time and the overridden
    objections."""
    from labctl.services.calibrations.certification import list_certifications
    from labctl.services.calibrations.release import list_waiting
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        rows, waiting = list_certifications(store, serial), list_waiting(store, serial)
    if as_json:
        print_json(rows)
    else:
        from labctl.cli.printing.calibrations import print_certifications

        print_certifications(rows, waiting)


def calibration(
    serial: Serial,
    version: Annotated[
        int | None, typer.Option("--version", metavar="N", help="Calibration version; default: the certified version.")
    ] = None,
    format_: Annotated[str, typer.Option("--format", metavar="NAME", help="json, c ...")] = "json",
    option: FormatOptions = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Path of a file to write; default: print the calibration."),
    ] = None,
    as_json: Json = False,  # noqa: ARG001  the calibration file is JSON already
    database: Database = None,
) -> None:
    """Print a calibration as a file to load elsewhere; what its format does not carry is said on standard error."""
    from labctl.services.calibrations.served import calibration_file
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        file = calibration_file(store, serial, version, format_, option or [])
        if out is None:
            sys.stdout.buffer.write(file.content)
        else:
            out.write_bytes(file.content)
    if file.withdrawn is not None:
        warning = f"labctl: calibration of {file.what} must not be used: {file.withdrawn.text}"
        stderr.print(warning, style="bold red", soft_wrap=True)
    for loss in file.losses:
        typer.echo(f"format {format_} cannot express: {loss.text}", err=True)


def compensate(
    calibration_file: Annotated[Path, typer.Argument(metavar="CALIBRATION_FILE")],
    source: Annotated[
        Path,
        typer.Argument(
            metavar="IN",
            help="File of samples to correct: CSV or Parquet with columns gyro_x ... and temperature_c, "
            "and accel_x_g ... where g-sensitivity is to be corrected.",
        ),
    ],
    target: Annotated[
        Path,
        typer.Argument(
            metavar="OUT",
            help="File to write, CSV or Parquet: the same rows with "
            "the corrected rates rate_x_dps ... and a column `outside`.",
        ),
    ],
    outside: Annotated[
        str,
        typer.Option(
            "--outside",
            help="What to do with samples outside the calibrated range: clamp (correct as "
            "at its edge and flag in column `outside`) or refuse.",
        ),
    ] = "clamp",
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  needs none: a calibration file is enough
) -> None:
    """Correct a file of readings by a calibration file; needs no database."""
    from labctl.services.calibrations.apply import compensate_file

    with one_clear_line():
        answer = compensate_file(calibration_file, source, target, outside)
    if as_json:
        print_json(answer)
        return
    if answer.warning:
        stderr.print(f"labctl: {answer.warning}", style="bold red")
    console.print(f"{answer.rows} readings -> {target}")
    if answer.left_out:
        console.print(answer.left_out, style="yellow")
    if answer.outside:
        console.print(
            f"{answer.outside} rows lie outside the calibrated range and are flagged in column `outside`",
            style="yellow",
        )
