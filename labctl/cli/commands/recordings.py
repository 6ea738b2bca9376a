"""`labctl import`, `labctl export recording` and `labctl simulate`: data in, data out, data made."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.import_dialogue import Acceptance, named, print_template, read_given
from labctl.cli.options import Beside, Database, ImporterName, ImporterOptions, Json, MapFile
from labctl.cli.output import console, print_json, print_warnings
from labctl.cli.printing.inspection import print_left_out

if TYPE_CHECKING:
    from labctl.answers.recordings import ImportResponse

export_app = typer.Typer(no_args_is_help=True, help="Export recordings from the database to files.")


PathToImport = Annotated[
    Path | None,
    typer.Argument(
        metavar="PATH",
        help="Folder with recording.toml and its data file; a CSV, Parquet or ULog file; a ROS bag; or a file that "
        "another installed importer reads.",
    ),
]
AcceptMap = Annotated[bool, typer.Option("--accept-map", help="Import with the proposed column map without asking.")]
WriteMap = Annotated[
    Path | None,
    typer.Option(
        "--write-map",
        metavar="FILE",
        help="Path of a file to write: the proposed column map; nothing is imported unless --accept-map is given too.",
    ),
]
TemplateKind = Annotated[
    str | None,
    typer.Option("--template", metavar="KIND", help="Print a CSV template: rest, rates, turns, profile or poses."),
]
LeaveOut = Annotated[
    list[str] | None,
    typer.Option(
        "--leave-out",
        metavar="KIND",
        help="Leave out the readings of one kind of finding: time_back, frozen, clipped, thermometer, spikes, "
        "repeated, moved, noise_changes, shifted, or all of these; may be repeated. They are marked as bad, counted "
        "and stated in the recording.",
    ),
]


def import_(
    path: PathToImport = None,
    importer: ImporterName = None,
    option: ImporterOptions = None,
    column_map: MapFile = None,
    beside: Beside = None,
    accept_map: AcceptMap = False,
    write_map: WriteMap = None,
    template: TemplateKind = None,
    leave_out: LeaveOut = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Import data made on any bench: in the interchange format, or a log, whose columns a map names."""
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import IMPORT_RECORDING
    from labctl.services.commands.requests import RecordingFolder
    from labctl.services.recordings.importers import as_interchange

    if template is not None:
        print_template(template)
        return
    with one_clear_line():
        accept = Acceptance(
            named(path), given=column_map is not None, accepted=accept_map, out=write_map, quiet=as_json
        )
        with as_interchange(
            accept.path, importer, option or [], read_given(column_map), accept.ask, beside or [], leave_out or []
        ) as folder:
            answer = execute(database, IMPORT_RECORDING, RecordingFolder(folder))
    if as_json:
        print_json(answer)
        return
    _print_imported(answer)


def _print_imported(answer: ImportResponse) -> None:
    """Print what was imported, what is doubtful of it, and what comes next."""
    from labctl.recording.info import GIVE_DATE

    print_warnings(answer.warnings)
    print_left_out(answer.left_out)
    if any(warning.n is not None for warning in answer.warnings):
        console.print(f"where in the recording: labctl inspect {answer.recording} --picture FILE.html", style="dim")
    if answer.measured_at is None:
        console.print(
            f"The file states no date, so the date of the measurement is not known; {GIVE_DATE}.", markup=False
        )
    console.print(
        f"recording {answer.recording} of {answer.serial}: {answer.datasets} data sets, {answer.readings} readings"
    )
    if answer.similar_unit is not None:
        console.print(
            f"unit {answer.serial} is new here; unit {answer.similar_unit} is there too: if that is the one that was "
            "measured, import the file again with its serial number",
            style="yellow",
        )
    console.print(f"next: labctl fit {answer.serial} --model {answer.suggested_model}", style="dim")


@export_app.command("recording")
def export_recording(
    recording: Annotated[int, typer.Argument(metavar="ID", help="Number of the recording.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="New folder to write; it must not exist.")],
    csv: Annotated[bool, typer.Option("--csv", help="Write CSV instead of Parquet.")] = False,
    points: Annotated[
        bool, typer.Option("--points", help="Write one row per data set instead of every reading.")
    ] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Write a recording in the interchange format: every reading, unchanged."""
    from labctl.answers.recordings import ExportedRecording
    from labctl.services.read_access import open_readonly
    from labctl.services.recordings.transfer import export_recording as export

    with one_clear_line(), open_readonly(database) as store:
        written = export(store, recording, out, "csv" if csv else "parquet", points=points)
    if as_json:
        print_json(ExportedRecording(recording=recording, folder=str(out), files=written))
    else:
        console.print(f"recording {recording} -> {out}: {', '.join(written)}")


SampleRate = Annotated[
    float | None, typer.Option("--sample-rate", metavar="HZ", help="Readings per second; default: 10.")
]


def simulate(
    recipe: Annotated[str, typer.Argument(metavar="RECIPE", help="Recipe file, or the name of a shipped recipe.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="New folder to write; it must not exist.")],
    bench: Annotated[
        str | None,
        typer.Option(
            "--bench",
            metavar="FILE",
            help="Bench file, or the name of a shipped bench; default: the shipped bench that suits the recipe best.",
        ),
    ] = None,
    gyro: Annotated[
        str | None,
        typer.Option("--gyro", metavar="NAME", help="Name of the bench's gyro to record; default: the first."),
    ] = None,
    hide: Annotated[
        list[str] | None,
        typer.Option(
            "--hide",
            metavar="EFFECT[=SIZE]",
            help="Hide an effect in the gyro; SIZE in the unit of the effect "
            "(`labctl effects`), or zN, such as z10, for a signal of N standard deviations of the noise.",
        ),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", help="Seed of the random numbers; the same seed gives the same recording.")
    ] = 1,
    sample_rate_hz: SampleRate = None,
    csv: Annotated[bool, typer.Option("--csv", help="Write CSV instead of Parquet.")] = False,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Make a recording on the simulated bench, with effects hidden in the gyro, in the interchange format."""
    from labctl.services.simulation.recordings import SimulateRequest, simulate_recording

    with one_clear_line():
        answer = simulate_recording(
            SimulateRequest(
                recipe=recipe, bench=bench, gyro=gyro, hide=hide or [], seed=seed, sample_rate_hz=sample_rate_hz
            ),
            out,
            "csv" if csv else "parquet",
        )
    if as_json:
        print_json(answer)
        return
    hidden = ", ".join(f"{name} = {size:.4g}" for name, size in answer.hidden.items()) or "nothing"
    console.print(f"{answer.serial}: {answer.datasets} data sets, {answer.readings} readings -> {out}")
    console.print(f"hidden in it: {hidden}", style="dim")
    console.print(f"next: labctl import {out}", style="dim")
