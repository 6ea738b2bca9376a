"""Options by which more than the poses of a file tells the accelerometer: an earlier version, the temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from labctl.services.pose_triads import Earlier as EarlierVersion

Earlier = Annotated[
    int | None,
    typer.Option(
        "--earlier",
        metavar="N",
        help="Use version N of the accelerometer of this unit (--serial) too, 0: its newest; four poses are then "
        "enough, and ten rests for the alignment.",
    ),
]
Temperature = Annotated[
    str | None,
    typer.Option(
        "--temperature",
        metavar="COLUMN",
        help="Fit bias and scale factors of the accelerometer over the temperature in this column, deg C (of a "
        "recording: its own): poses at two temperatures or more that span 5 K.",
    ),
]
ScaleChange = Annotated[
    float,
    typer.Option(
        "--scale-change", metavar="U", help="With --earlier: standard uncertainty of a scale factor's change since."
    ),
]
MisalignmentChange = Annotated[
    float,
    typer.Option("--misalignment-change", metavar="U", help="With --earlier: the same of a misalignment, rad."),
]


def earlier_version(
    database: str | None, serial: str | None, number: int | None, changes: tuple[float, float]
) -> EarlierVersion | None:
    """Return the version of a unit's accelerometer that --earlier names, and what may have changed since.

    `changes` are those of a scale factor and of a misalignment. Raises BadInput without a unit, NotFound.
    """
    from labctl.errors import BadInput
    from labctl.services.pose_triads import Earlier as Found
    from labctl.services.read_access import open_readonly
    from labctl.services.sensor_versions import one_accelerometer

    if number is None:
        return None
    if serial is None:
        raise BadInput("--earlier needs --serial: name the unit of which it is a version")
    with open_readonly(database) as store:
        version = one_accelerometer(store, serial, number or None)
    return Found(version.version, version.result, *changes)
