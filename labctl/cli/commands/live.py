"""`labctl live`: calibrate while a person turns the unit."""

from __future__ import annotations

from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.interrupts import ending_is_an_interrupt
from labctl.cli.options import BenchName, Database, DriverOptions, Json, WireLogOnly
from labctl.cli.output import print_json

if TYPE_CHECKING:
    from labctl.services.live.source import LiveSource

#: Where ROS drivers of inertial units publish, by REP 145.
TOPIC = "/imu/data"

Unit = Annotated[
    str | None,
    typer.Argument(
        metavar="[SERIAL]", help="Serial number of the unit; with --bench it may be left out: the first gyro."
    ),
]
Driver = Annotated[
    str | None, typer.Option("--driver", metavar="NAME", help="Driver of the gyro, instead of a bench file.")
]
Port = Annotated[
    str | None,
    typer.Option("--port", metavar="PORT", help="Port of the gyro for --driver, such as /dev/ttyUSB0."),
]
Lines = Annotated[
    str | None,
    typer.Option(
        "--lines",
        metavar="SOURCE",
        help="Readings as lines of JSON or CSV: - for standard input, tcp:// or udp://HOST:PORT; of a rosbridge "
        "server: ws://HOST:PORT.",
    ),
]
LineColumns = Annotated[
    str | None,
    typer.Option("--columns", metavar="A,B,C", help="Names of the values of a CSV line, where it has no header."),
]
Topic = Annotated[
    str,
    typer.Option("--topic", metavar="NAME", help="Topic of a rosbridge server, of type sensor_msgs/Imu."),
]
Rate = Annotated[
    float | None, typer.Option("--rate", metavar="HZ", help="Readings per second, for lines without a time.")
]
Speed = Annotated[
    float | None,
    typer.Option(
        "--speed",
        metavar="X",
        help="Speed of a simulated bench, as a multiple of real time; default: as fast as the computer can.",
    ),
]
Latitude = Annotated[
    float | None,
    typer.Option(
        "--latitude", metavar="DEG", min=-90, max=90, help="Latitude; with --bench that of the bench file is used."
    ),
]
LargestU = Annotated[
    float,
    typer.Option(
        "--target", metavar="U", help="Limit of the expanded uncertainty (k = 2) of scale factors and misalignments."
    ),
]
LargestBiasU = Annotated[
    float | None,
    typer.Option("--target-bias", metavar="DPS", help="Limit of the expanded uncertainty (k = 2) of biases, deg/s."),
]
Poses = Annotated[
    int, typer.Option("--poses", metavar="N", help="Poses to ask for, 12 to 26: six faces, twelve edges, corners.")
]
Rest = Annotated[float, typer.Option("--rest", metavar="S", help="How long the unit is to rest in each pose, s.")]
Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="New folder that keeps the readings as a recording, too."),
]


def live(
    serial: Unit = None,
    bench: BenchName = None,
    driver: Driver = None,
    port: Port = None,
    option: DriverOptions = None,
    lines: Lines = None,
    topic: Topic = TOPIC,
    columns: LineColumns = None,
    rate_hz: Rate = None,
    latitude_deg: Latitude = None,
    speed: Speed = None,
    target_u: LargestU = 1e-3,
    target_bias_dps: LargestBiasU = None,
    poses: Poses = 18,
    rest_s: Rest = 2.0,
    out: Out = None,
    wire_log: WireLogOnly = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Calibrate a unit while you turn it: shows which pose comes next, and how U falls.

    The readings become a recording, also when you end it with Ctrl-C; a version is fitted when the target is reached.
    """
    from labctl.cli.printing.live import LivePrinter, print_live
    from labctl.fitting.live import Target
    from labctl.services.commands.open import DatabaseCommands
    from labctl.services.live.assessor import BackgroundAssessor, InlineAssessor
    from labctl.services.live.calibrate import calibrate_live
    from labctl.services.recordings.live_folders import kept_beside, usual_folder

    with one_clear_line(), LivePrinter() as printer, ExitStack() as opened:
        target = Target(target_u, target_bias_dps, poses, rest_s)
        source = (
            opened.enter_context(_gyro_source(serial, bench, driver, port, option or [], latitude_deg, speed, wire_log))
            if lines is None
            else _line_source(serial, lines, topic, columns, rate_hz, latitude_deg, speed, wire_log)
        )
        assessor = InlineAssessor() if source.is_simulated else BackgroundAssessor()  # a real stream goes on meanwhile
        folder = out or usual_folder(database, source.serial, f"{source.clock.utc():%Y%m%dT%H%M%SZ}")
        for session in kept_beside(database):
            printer.say(session.text)
        answer = calibrate_live(
            DatabaseCommands(database), source, target, assessor, folder, keep_folder=out is not None,
            show=printer.show, say=printer.say, attended=ending_is_an_interrupt(),
        )  # fmt: skip
    (print_json if as_json else print_live)(answer)
    if answer.fit is None:
        raise typer.Exit(1)


def _line_source(
    serial: str | None, lines: str, topic: str, columns: str | None, rate_hz: float | None, latitude_deg: float | None,
    speed: float | None, wire_log: Path | None,
) -> LiveSource:  # fmt: skip
    from instruments.clock import SystemClock
    from labctl.errors import BadInput
    from labctl.recording.line_stream import LineDecoder
    from labctl.services.live.feeds import feed_of
    from labctl.services.live.line_source import LineSource, info_of

    if speed is not None:
        raise BadInput(f"--speed {speed:g}: lines arrive as they are sent; leave the option out")
    if wire_log is not None:
        raise BadInput(
            f"--wire-log {wire_log}: lines come from another program and not from an instrument; keep them with `tee`, "
            "and leave the option out"
        )
    if serial is None:
        raise BadInput("the lines do not say which unit it is; give its serial number: labctl live SERIAL --lines ...")
    clock = SystemClock()
    info = info_of(serial, clock, latitude_deg, rate_hz)
    decoder = LineDecoder(columns.split(",") if columns else (), rate_hz)
    return LineSource(feed_of(lines, topic), decoder, info, clock)


def _gyro_source(
    serial: str | None, bench: str | None, driver: str | None, port: str | None, options: list[str],
    latitude_deg: float | None, speed: float | None, wire_log: Path | None,
) -> AbstractContextManager[LiveSource]:  # fmt: skip
    from labctl.errors import BadInput
    from labctl.services.campaigns.preparation import clock_for
    from labctl.services.live.gyro_source import bench_of_driver, recorded_source
    from labctl.services.planning.loading import load_bench

    if (bench is None) == (driver is None):
        raise BadInput(
            "name the stream of the unit by one of --bench FILE, --driver NAME with --port, or --lines SOURCE"
        )
    if bench is not None:
        loaded = load_bench(bench)
        return recorded_source(loaded, serial, clock_for(loaded, speed), wire_log)
    if serial is None or port is None or driver is None:
        raise BadInput("--driver needs the serial number of the unit and its --port: labctl live SERIAL --driver ...")
    bench_file = bench_of_driver(driver, port, serial, options, latitude_deg)
    return recorded_source(bench_file, serial, clock_for(bench_file, speed), wire_log)
