"""The options that every command shares."""

from __future__ import annotations

from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from labctl.errors import BadInput

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, and nothing else.")]
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL_OR_PATH",
        help="Database file or URL; default: $LABCTL_DATABASE if set, else a file in the user's data folder.",
    ),
]
WireLog = Annotated[
    Path | None,
    typer.Option(
        "--wire-log",
        metavar="FILE",
        help="File for every byte between labctl and the instruments, compressed; `labctl replay FILE` does it again.",
    ),
]
WireLogOnly = Annotated[
    Path | None,
    typer.Option(
        "--wire-log", metavar="FILE", help="File for every byte between labctl and the instruments, compressed."
    ),
]
Search = Annotated[
    str, typer.Option("--search", metavar="TEXT", help="Only rows that hold this text, in any case; default: all rows.")
]
Limit = Annotated[int | None, typer.Option("--limit", min=1, metavar="N", help="Largest number of rows; default: all.")]
Serial = Annotated[str, typer.Argument(metavar="SERIAL", help="Serial number of the unit.")]
AcceptWarnings = Annotated[
    bool,
    typer.Option(
        "--accept-warnings",
        help="Fit the data although labctl found errors in them, and keep the fit even if "
        "it is worse than no correction.",
    ),
]
BenchName = Annotated[
    str | None,
    typer.Option("--bench", metavar="FILE", help="Bench file, or the name of a bench that ships with labctl."),
]
SimulatedSpeed = Annotated[
    float | None,
    typer.Option(
        "--speed", metavar="X", help="Speed of a simulated bench: X times real time; default: as fast as possible."
    ),
]
CampaignId = Annotated[
    int | None, typer.Argument(metavar="ID", help="Number of the campaign; default: the newest campaign.")
]
RecordingIds = Annotated[
    str | None,
    typer.Option(
        "--recording",
        metavar="ID[,ID...]",
        help="Number of the recording, or several numbers to use recordings together, such as 1,2,3; default: "
        "the unit's newest recording that can be fitted, together with the others of its diagnosis, if it belongs to "
        "one.",
    ),
]
RecordingId = Annotated[
    int | None,
    typer.Option("--recording", metavar="ID", help="Number of the recording; default: the unit's newest recording."),
]

SimulatedStart = Annotated[
    str | None,
    typer.Option(
        "--simulated-start",
        metavar="TIME",
        help="Date at which the time of a simulated bench begins, such as 2027-11-23T08:00Z; without an offset: UTC.",
    ),
]


def simulated_start(text: str | None) -> datetime | None:
    """Return the instant at which simulated time begins, UTC; None where none was given. Raises BadInput."""
    try:
        moment = None if text is None else datetime.fromisoformat(text)
        if moment is None:
            return None
        return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise BadInput(
            f"--simulated-start {text!r} cannot be read; write 2027-11-23T08:00Z, or a date such as 2027-11-23"
        ) from error


def recording_numbers(listed: str | None) -> list[int]:
    """Return the numbers of recordings in "3" or "1,2,3", none where nothing was given. Raises BadInput."""
    numbers: list[int] = []
    for text in (listed or "").split(",") if listed is not None else ():
        if not text.strip().isdecimal() or not text.isascii():
            raise BadInput(
                f"--recording {listed!r}: {text!r} is not a recording number; write one number such as 3, "
                "or several as 1,2,3"
            )
        numbers.append(int(text))
    return numbers


def day(text: str | None, option: str) -> date | None:
    """Return the day that an option states; None where it states none. Raises BadInput."""
    try:
        return None if not text else date.fromisoformat(text)
    except ValueError as error:
        raise BadInput(f"{option} {text!r} is not a day; write it as 2027-11-23") from error


def instant(text: str | None, option: str) -> datetime | None:
    """Return the instant that an option states, without an offset UTC; None where it states none. Raises BadInput."""
    try:
        moment = None if not text else datetime.fromisoformat(text)
    except ValueError as error:
        raise BadInput(f"{option} {text!r} is not a time; write it as 2027-11-23T08:00Z") from error
    return moment.replace(tzinfo=UTC) if moment is not None and moment.tzinfo is None else moment


ImporterName = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help="Name of the importer that reads the file; default: the importer that recognises the file best.",
    ),
]


def _key_values(option: str) -> Any:
    """Return the option --option of what it is for."""
    return typer.Option("--option", metavar="KEY=VALUE", help=f"{option}, as KEY=VALUE; may be repeated.")


ImporterOptions = Annotated[list[str] | None, _key_values("Option of the importer")]
FormatOptions = Annotated[list[str] | None, _key_values("Option of the format")]
DriverOptions = Annotated[list[str] | None, _key_values("Setting of the driver")]
MapFile = Annotated[
    Path | None,
    typer.Option(
        "--map",
        metavar="FILE",
        help="Column map (TOML): which column of the log is which quantity; default: labctl proposes a map and asks.",
    ),
]
Beside = Annotated[
    list[Path] | None,
    typer.Option(
        "--beside", metavar="FILE", help="File with further columns of the same run, joined by time; may be repeated."
    ),
]
SensorSerial = Annotated[
    str | None,
    typer.Option(
        "--serial",
        metavar="SERIAL",
        help="Keep the result as the next version of this unit's sensor; default: it is only printed.",
    ),
]
By = Annotated[str | None, typer.Option("--by", metavar="NAME", help="Who; default: the user who is logged in.")]
SensorExport = Annotated[
    str | None,
    typer.Option(
        "--export",
        metavar="NAME",
        help="Write the calibration to --out: px4, ardupilot, json, python, c, tf2, urdf; an accelerometer also "
        "kalibr, ros.",
    ),
]
Out = Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Path of the file to write.")]
SensorInstance = Annotated[
    int | None,
    typer.Option(
        "--instance",
        metavar="N",
        help="Number of the sensor at the autopilot: px4 from 0, ardupilot from 1; default: the first.",
    ),
]
DeviceId = Annotated[
    int | None, typer.Option("--device-id", metavar="ID", min=1, help="Device id of the sensor at the autopilot.")
]


def who(by: str | None) -> str:
    """Return who acts: as given, or the user who is logged in."""
    from labctl.acting_user import actor

    return by or actor().name


def names_in(text: str | None) -> list[str]:
    """Return the names of a list with commas; none for no list."""
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def pair(option: str, text: str | None) -> tuple[float, float] | None:
    """Return the two numbers of an option LOW,HIGH; None without the option. Raises BadInput for anything else."""
    if text is None:
        return None
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise BadInput(f"{option} {text!r} is not two numbers; give LOW,HIGH, such as {option} -100,100") from None
    return low, high
