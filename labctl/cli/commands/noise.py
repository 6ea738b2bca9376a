"""`labctl allan` and `orientation`: noise at rest, and the angle that a rate adds up to."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.import_dialogue import read_given
from labctl.cli.options import Database, ImporterName, ImporterOptions, Json, RecordingId, recording_numbers
from labctl.cli.output import console, format_number, print_json, stderr
from labctl.cli.printing.noise import print_allan

if TYPE_CHECKING:
    from labctl.answers.orientation import OrientationResponse


WarmUp = Annotated[
    float, typer.Option("--warm-up-s", metavar="S", min=0, help="Leave the readings of the first S seconds out.")
]
StopEvery = Annotated[
    float | None,
    typer.Option(
        "--stop-every-s",
        metavar="S",
        help="For a recording at rest: treat 10 s in every S seconds as a stop and the rest as motion, and "
        "print the drift.",
    ),
]
Rest = Annotated[
    float,
    typer.Option(
        "--rest-s",
        metavar="S",
        min=0,
        help="The unit is at rest for the first S seconds: subtract the mean rate of that time (static bias).",
    ),
]
Axis = Annotated[str | None, typer.Option("--axis", help="Axis x, y or z; default: the only axis of the data.")]
Instability = Annotated[
    float,
    typer.Option(
        "--instability-dps",
        metavar="X",
        min=0,
        help="Bias instability of the gyro, deg/s; it is part of the uncertainty of the static bias.",
    ),
]
Standstill = Annotated[
    bool,
    typer.Option(
        "--standstill/--no-standstill",
        help="While the unit stands still, hold the angle and estimate the offset again.",
    ),
]
Correction = Annotated[
    Path | None,
    typer.Option("--calibration", metavar="FILE", help="Calibration file by which a table is corrected."),
]
Records = Annotated[
    str | None,
    typer.Option(
        "--recording",
        metavar="ID[,ID...]",
        help="Number of the recording, or several numbers to compare recordings side by side, such as 1,2,3; "
        "default: the unit's newest recording.",
    ),
]
ReadByMap = Annotated[
    Path | None,
    typer.Option(
        "--map",
        metavar="FILE",
        help="Column map (TOML) by which a log is read, as `labctl import` reads it; default: a CSV or Parquet file "
        "is read as it is, of another log the map is proposed.",
    ),
]
CorrectingVersion = Annotated[
    int | None,
    typer.Option(
        "--version",
        metavar="N",
        min=0,
        help="Version of the calibration that corrects a unit's recording; "
        "0: no correction; default: the certified version.",
    ),
]


def allan(
    source: Annotated[
        str,
        typer.Argument(metavar="SERIAL|FILE", help="Serial number of a unit, or path of a file or folder of readings."),
    ],
    column: Annotated[
        str | None,
        typer.Option(
            "--column",
            metavar="NAME",
            help="Column of a file to use; default: every column whose name begins with gyro_.",
        ),
    ] = None,
    recording: Records = None,
    column_map: ReadByMap = None,
    importer: ImporterName = None,
    option: ImporterOptions = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Allan deviation of a record at rest, with N, B and K of IEEE Std 952; no fit, table or thermometer needed."""
    from labctl.errors import BadInput
    from labctl.services.read_access import open_readonly
    from labctl.services.recordings.allan_source import allan_of_file, allan_of_recordings

    path = Path(source)
    with one_clear_line():
        numbers = recording_numbers(recording)
        if path.exists():
            if numbers:
                raise BadInput(f"{source} is a file, but --recording names stored recordings; leave --recording out")
            answers = [
                allan_of_file(
                    path, column, column_map=read_given(column_map), importer=importer, options=option or []
                )
            ]  # fmt: skip
        elif column_map is not None or importer is not None or option:
            raise BadInput(
                f"{source}: there is no such file; leave out --map, --format and --option, which need a file, if "
                f"{source} is the serial number of a unit"
            )
        else:
            with open_readonly(database) as store:
                answers = allan_of_recordings(store, source, numbers, column)
    if as_json:
        print_json(answers[0] if len(answers) == 1 else answers)
    else:
        print_allan(answers)


def orientation(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SERIAL|FILE",
            help="Serial number of a unit, or path of a table with columns t_s, gyro_z ... and temperature_c.",
        ),
    ],
    axis: Axis = None,
    rest_s: Rest = 0.0,
    instability_dps: Instability = 0.0,
    standstill: Standstill = True,
    warm_up_s: WarmUp = 0.0,
    stop_every_s: StopEvery = None,
    calibration: Correction = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Path of a file to write: the table and its angle.")
    ] = None,
    recording: RecordingId = None,
    version: CorrectingVersion = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Follow the angle of one axis: static bias off (Ojeda 2000, eqs. 15-16), offset renewed at standstill (Weiss)."""
    from labctl.answers.orientation import OrientationOptions
    from labctl.errors import BadInput
    from labctl.services.calibrations.orientation import orientation_of_file, orientation_of_unit
    from labctl.services.read_access import open_readonly

    with one_clear_line():
        options = OrientationOptions(
            axis=axis, rest_s=rest_s, instability_dps=instability_dps, standstill=standstill, warm_up_s=warm_up_s,
            stop_every_s=stop_every_s,
        )  # fmt: skip
        if Path(source).is_file():
            answer = orientation_of_file(Path(source), calibration, out, options)
        elif calibration is not None or out is not None:
            raise BadInput(
                f"{source}: there is no such file; leave out --calibration and --out, which need a "
                f"file, if {source} is the serial number of a unit"
            )
        else:
            with open_readonly(database) as store:
                answer = orientation_of_unit(store, source, recording, version, options)
    if as_json:
        print_json(answer)
    else:
        _print(answer)


def _print(answer: OrientationResponse) -> None:
    if answer.warning:
        stderr.print(f"labctl: {answer.warning}", style="bold red")
    by = "uncorrected" if answer.version is None else f"corrected by version {answer.version}"
    console.print(f"axis {answer.axis}, {by}: {answer.readings} readings, {answer.left_out} left out")
    if (bias := answer.static_bias) is not None:
        console.print(f"  static bias  {format_number(bias.bias_dps)} deg/s, u = {format_number(bias.u_dps, 2)} deg/s")
    console.print(f"  angle        {answer.angle_deg:.3f} deg after {answer.seconds:.1f} s")
    if answer.drift_deg_per_min is not None:
        console.print(f"  per minute   {format_number(answer.drift_deg_per_min)} deg/min")
    if legs := answer.drift_between_stops_deg_per_min:
        drifts = ", ".join(format_number(leg, 2) for leg in legs)
        console.print(f"  between stops {drifts} deg/min")
    console.print(f"  standing     {answer.standing_s:.1f} s; offset {format_number(answer.offset_dps)} deg/s")
    if answer.gap_s:
        console.print(f"  without readings {answer.gap_s:.1f} s", style="yellow")
