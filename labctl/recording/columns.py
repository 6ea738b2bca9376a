"""The columns of the interchange format, as a table: name, type, unit and meaning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from labctl.answers.recording_head import Motion
    from labctl.recording.info import RecordingInfo

Kind = Literal["integer", "number", "text"]


@dataclass(frozen=True)
class Column:
    """One column of the format. `needed_for` names the kinds of recording that cannot do without it.

    `motions` names the motions for which it is needed by those kinds; empty: all of them.
    """

    name: str
    kind: Kind
    unit: str
    meaning: str
    needed_for: frozenset[str] = frozenset()
    motions: frozenset[Motion] = frozenset()


#: Columns of several recordings as one: which recording a row is of, its time within it, and its data set there.
RECORDING, WITHIN_S, OWN_DATASET = "recording", "recording_t_s", "recording_dataset"
#: Column of the data sets that no fit takes in.
VERIFICATION = "verification"

#: Standard uncertainties of the time of a reference rate that changes: of each data set, and what all have in common.
TIME_U_S, TIME_COMMON_U_S = "table_time_u_s", "table_time_common_u_s"
RATE_TIME_U = frozenset({TIME_U_S, TIME_COMMON_U_S})

#: Times of a reading beside `t_s`, which is computed from them: no quantity that is measured.
DEVICE_S, ARRIVAL_S = "device_s", "arrival_s"
READING_TIMES = frozenset({DEVICE_S, ARRIVAL_S})

_BOTH = frozenset({"samples", "points"})
_ON_TABLE: frozenset[Motion] = frozenset({"rates", "profile"})
_IN_POSES: frozenset[Motion] = frozenset({"poses"})

COLUMNS = (
    Column("dataset", "integer", "", "number of the data set", _BOTH),
    Column("t_s", "number", "s", "time since started_at", frozenset({"samples"})),
    Column(DEVICE_S, "number", "s", "time by the unit's own clock, from its own zero"),
    Column(ARRIVAL_S, "number", "s", "time since started_at at which the reading had arrived"),
    Column("position", "text", "", "body axis along the table axis, with its sign; tilted a sum of axes, x+y+z"),
    Column("run", "integer", "", "powered session"),
    Column("mounting", "integer", "", "number of the mounting: increases each time the unit is mounted again"),
    Column("verification", "integer", "", "1: measured to verify a calibration, and never fitted"),
    Column("power_s", "number", "s", "time since the unit was last switched on"),
    Column("table_rate_dps", "number", "deg/s", "true rate of the table", _BOTH, _ON_TABLE),
    Column("computed_rate_dps", "number", "deg/s", "commanded rate of the table"),
    Column("encoder_rate_dps", "number", "deg/s", "rate by the table's encoder, of the whole data set"),
    Column("encoder_rate_u_dps", "number", "deg/s", "standard uncertainty of encoder_rate_dps"),
    Column(TIME_U_S, "number", "s", "standard uncertainty of the time of table_rate_dps, of its own in each data set"),
    Column(TIME_COMMON_U_S, "number", "s", "standard uncertainty of that time that all data sets have in common"),
    Column("turn_deg", "number", "deg", "angle that the unit turned by in a data set", _BOTH, frozenset({"turns"})),
    Column("turn_u_deg", "number", "deg", "standard uncertainty of turn_deg"),
    Column("duration_s", "number", "s", "length of the data set", frozenset({"points"}), frozenset({"turns"})),
    Column("table_angle_deg", "number", "deg", "table angle, unwrapped within a data set"),
    Column(
        "temperature_c",
        "number",
        "deg C",
        "the gyro's own thermometer",
        _BOTH,
        frozenset({"rates"}),
    ),
    *(Column(f"temperature_{a}_c", "number", "deg C", f"thermometer of axis {a}") for a in "xyz"),
    Column("chamber_c", "number", "deg C", "chamber air"),
    Column("chamber_setpoint_c", "number", "deg C", "set point of the chamber"),
    Column("reference_c", "number", "deg C", "a reference thermometer beside the gyro, traceable by itself"),
    Column("humidity_pct", "number", "%", "relative humidity of the air"),
    Column("own_temperature_c", "number", "deg C", "the gyro's own thermometer where a reference stands for it"),
    Column("supply_v", "number", "V", "supply voltage of the gyro"),
    *(Column(f"accel_{a}_g", "number", "g", f"specific force along body axis {a}", _BOTH, _IN_POSES) for a in "xyz"),
    *(Column(f"field_{a}_ut", "number", "microtesla", f"magnetic field along body axis {a}") for a in "xyz"),
    Column("valid", "integer", "", "0: the instrument marked this reading as bad"),
    *(Column(f"gyro_{a}", "number", "as [output]", f"output of axis {a}") for a in "xyz"),
    *(
        Column(f"gyro_{a}_std", "number", "as [output]", f"standard deviation of the readings behind gyro_{a}")
        for a in "xyz"
    ),
    *(Column(f"gyro_{a}_white_std", "number", "as [output]", f"white-noise part of gyro_{a}_std") for a in "xyz"),
    *(
        Column(
            f"gyro_{a}_quantisation_std",
            "number",
            "as [output]",
            f"standard uncertainty of the mean due to the resolution of gyro_{a}",
        )
        for a in "xyz"
    ),
    Column("n", "integer", "", "number of readings behind a mean"),
    Column("scale_factor", "number", "output unit per deg/s", "scale factor"),
    Column("offset", "number", "output unit", "output at rest"),
    Column("axis", "text", "", "axis of a row of coefficients"),
)

BY_NAME = {column.name: column for column in COLUMNS}
#: The motions in which a position says about which axis the unit turned.
POSITIONED: frozenset[Motion] = frozenset({"rates", "turns", "profile"})


def holds_flags(name: str) -> bool:
    """Whether a column of a recording holds true and false, as 1 and 0."""
    return name in {"valid", VERIFICATION}


def needed(info: RecordingInfo) -> list[str]:
    """Return the names of the columns that a recording of this kind, motion and these axes must have."""
    if info.kind == "coefficients":
        return []  # its form says
    names = [
        column.name
        for column in COLUMNS
        if info.kind in column.needed_for and (not column.motions or info.motion in column.motions)
    ]
    if len(info.axes) > 1 and info.motion in POSITIONED:
        names.append("position")
    return names + [f"gyro_{axis}" for axis in info.axes]


ENVIRONMENT_NEEDED = ("t_s", "temperature_c")
