"""What the name of a column says: its unit, and which column of a recording it is."""

from __future__ import annotations

import re
from dataclasses import dataclass

from labctl.recording.column_map.units import QUANTITIES, find_unit, is_lsb, names_of_units, unit_of_target
from labctl.recording.columns import BY_NAME

#: The axis or index at the end of a name whose unit stands before it: `gyro_dps[0]`, `gyro_dps_x`.
_AFTER_UNIT = re.compile(r"^(.+?)(\[[012]\]|[_. ][xyzXYZ])$")
_BRACKETS = re.compile(r"^(.*?)[\s_.-]*[\[(]\s*([^\])]+?)\s*[\])]\s*$")
#: Units that stand at the end of a name without brackets, longest first; in place of a stroke also "_" or "_per_".
_ENDINGS = tuple(
    sorted(
        {
            name.lower().replace("/", between)
            for name in (*names_of_units(), "m/s2", "lsb", "raw")
            for between in ("/", "_", "_per_")
        },
        key=lambda name: (-len(name), name),
    )
)
_AXIS = r"(?P<axis>[xyz])"
_INDEX = {"0": "x", "1": "y", "2": "z"}
_ANY = r"(?:.*[_ ])?"
_RAW = r"[_ ]?(?:raw[_ ]?)?"
_GYRO = (
    "gyroscope|gyro|gyr|angularvelocity|angular velocity|angvel|angular rate|omega|rotationrate|rotation rate|drehrate|"
    "winkelgeschwindigkeit"
)
_ACCEL = "accelerometer|acceleration|accel|acc|specific force|linear acceleration"
_TABLE = "table|rig|turntable|stage"
_TIME = (
    "time ?stamp|time|clock|datetime|date|millis|micros|nanos|epoch|stamp|t|elapsed|uptime|seconds|filetime|datenum|"
    "i?tow|time of week|seconds of week|zeit|uhrzeit|zeitstempel|datum"
)
#: Axes of a vehicle's rates (ISO 8855, aviation): x forward, y across, z along the third.
_VEHICLE = {"roll": "x", "pitch": "y", "yaw": "z"}

#: Names, folded -> column of a recording; `{axis}` is the axis that the name has.
_RULES: tuple[tuple[str, str], ...] = (
    (rf"{_ANY}(?:{_GYRO}){_RAW}{_AXIS}", "gyro_{axis}"),
    (rf"(?:g|w|imu g|imu w){_AXIS}", "gyro_{axis}"),
    (rf"{_AXIS}[_ ]?(?:gyroscope|gyro|gyr|omega|angular velocity|rate)", "gyro_{axis}"),
    (rf"rate[_ ]?{_AXIS}", "gyro_{axis}"),
    *((rf"(?:(?:{_GYRO}|imu|body)[_ ])?{turn}[_ ]?rate", f"gyro_{axis}") for turn, axis in _VEHICLE.items()),
    (rf"{_ANY}(?:{_ACCEL}){_RAW}{_AXIS}", "accel_{axis}_g"),
    (rf"(?:a|f|imu a){_AXIS}", "accel_{axis}_g"),
    (rf"{_AXIS}[_ ]?(?:accelerometer|acceleration|accel|acc)", "accel_{axis}_g"),
    (rf"{_ANY}(?:magnetometer|magnetic field|mag|field)\d?[_ ]?{_AXIS}", "field_{axis}_ut"),
    (
        rf"{_ANY}(?:{_TABLE}|reference|ref|true|commanded|cmd)[_ ](?:angular )?(?:rate|speed|velocity|omega)",
        "table_rate_dps",
    ),
    (r"(?:rate|speed|omega)[_ ](?:command|commanded|cmd|demand|demanded|setpoint|set)", "table_rate_dps"),
    (rf"{_ANY}(?:{_TABLE}|encoder)[_ ](?:angle|position|pos)", "table_angle_deg"),
    (r"(?:turn|turned|turn angle|turned angle)", "turn_deg"),
    (r"(?:chamber|oven|ambient|air|env|environment)(?:[_ ](?:temperature|temp|t|air))?", "chamber_c"),
    (r"(?:chamber|oven)?[_ ]?(?:setpoint|set point)(?:[_ ](?:temperature|temp))?", "chamber_setpoint_c"),
    (rf"{_ANY}(?:temperature|temp|thermometer|temperatur)(?:[_ ](?:imu|gyro|die|raw|1))?", "temperature_c"),
    (r"(?:d|die|imu|gyro|t)temp", "temperature_c"),
    (r"(?:supply|vcc|vdd|supply voltage|voltage)", "supply_v"),
    (rf"{_ANY}(?:{_TIME})(?:[_ ]?(?:utc|boot|sample|since boot))?", "t_s"),
    (r"(?:gyro|gyroscope|angular rate|rate|angular velocity|gyro out|gyro output|gyro rate|output)", "gyro_z"),
    (r"(?:position|orientation|up|up axis)", "position"),
    (r"valid", "valid"),
)
_MEASURED_RATE = re.compile(
    r"^(?:(?:rate|speed|omega|velocity)[\s_.-]*(?:measured|meas|actual|act|feedback|fbk|fb|encoder|enc)"
    r"|(?:measured|meas|actual|act|feedback|fbk|fb|encoder|enc)[\s_.-]*(?:rate|speed|omega|velocity))(?![a-z])",
    re.IGNORECASE,
)
#: Names of clocks that are names of their unit.
_CLOCKS = {"millis": "ms", "micros": "us", "nanos": "ns", "seconds": "s"}
_COMPILED = tuple((re.compile(pattern), target) for pattern, target in _RULES)
#: Names of columns that number or name stretches of a log.
PARTS = re.compile(
    r"(?:part|data ?set|set|segment|label|phase|section|activity|step|burst)(?: ?(?:id|no|number|name))?"
)
#: Names of columns that count readings.
COUNTERS = re.compile(
    r"(?:n |num )?(?:samples?|index|idx|seq|sequence|counter|count|row|no|n|packet|id|frame)"
    r"(?: ?(?:id|no|number|count|counter))?"
)


@dataclass(frozen=True)
class NameSays:
    """What a name says: the column of a recording, or empty, and the unit, or empty."""

    target: str
    unit: str


def folded(name: str) -> str:
    """Return a name in lower case, words apart: `GyroX` and `gyro_x` are `gyro x`, `angular_velocity.x` too."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())
    apart = re.sub(r"\[([012])\]", lambda match: " " + _INDEX[match[1]], apart)
    return re.sub(r"[\s_.\-:/]+", " ", apart).strip().lower()


def name_says(name: str) -> NameSays:
    """Return what a column's name says about it."""
    stripped = name.strip()
    if stripped in BY_NAME:
        unit = unit_of_target(stripped)
        return NameSays(stripped, "" if stripped.startswith("gyro_") else unit)
    for stem, unit in _divided(stripped):
        target = _target(stem)
        if unit and not _is_unit_of(target, unit) and (by_unit := _by_unit(stem, unit)).target:
            return by_unit
        if target and _is_unit_of(target, unit):
            return NameSays(target, unit or (_CLOCKS.get(folded(stem), "") if target == "t_s" else ""))
    brackets = _BRACKETS.match(stripped)
    if brackets is None:
        return NameSays(_target(stripped), "")
    target = _target(brackets[1])
    if is_unit(brackets[2]) and not target.startswith("gyro_"):
        # of another quantity than the name says: T[C] is no time, and temp [V] no temperature yet
        return _by_unit(brackets[1], brackets[2])
    return NameSays(target, "")  # a unit that is not known is none


def is_commanded(name: str) -> bool:
    """Whether a name is of what an instrument was asked for, and not of what was measured."""
    return re.search(r"\b(?:command|commanded|cmd|demand|demanded|setpoint|set|target)\b", folded(name)) is not None


def as_measured_rate(name: str) -> str:
    """Return `rate_meas [deg/s]` or `speed feedback` as the name of a table's rate; empty for other names.

    Beside a rate that was asked for it is what the table did; alone it may be the gyro's.
    """
    renamed, n = _MEASURED_RATE.subn("table rate", name.strip(), count=1)
    return renamed if n else ""


def is_bare_rate(name: str) -> bool:
    """Whether a name says a rate and not whose: alone it is the gyro's, beside an output of the gyro the table's."""
    stems = (folded(stem) for stem, _ in _divided(name.strip()))
    return any(stem in {"rate", "angular rate", "angular velocity", "omega"} for stem in stems)


def is_second_choice(name: str) -> bool:
    """Whether a column gives way to another of the same meaning: a rate that was asked for, or one of a vehicle."""
    return is_commanded(name) or re.match(rf"(?:{'|'.join(_VEHICLE)})[_ ]?rate\b", folded(name)) is not None


def is_unit(text: str) -> bool:
    """Whether a text names a unit of any quantity."""
    return is_lsb(text) or any(find_unit(quantity, text) is not None for quantity in QUANTITIES)


def _by_unit(stem: str, unit: str) -> NameSays:
    """Return what a name means whose one letter is that of two quantities, by its unit."""
    if folded(stem) in {"t", "t imu", "t gyro", "temp"} and find_unit("deg C", unit) is not None:
        return NameSays("temperature_c", unit)
    return NameSays("", "")


def in_unit(name: str, unit: str) -> NameSays:
    """Return what a name says whose unit the file states apart from it, as in a second row of the header."""
    says = name_says(name)
    if says.unit or not is_unit(unit):
        return says
    return name_says(f"{name.strip()} [{unit}]")


def _divided(name: str) -> list[tuple[str, str]]:
    """Return how a name may divide into what it means and its unit, the surest first; the last is without a unit."""
    pairs: list[tuple[str, str]] = []
    if (brackets := _BRACKETS.match(name)) is not None and brackets[2] not in _INDEX:
        pairs.append((brackets[1], _plain_unit(brackets[2])))
    pairs += _ended(name)
    if (after := _AFTER_UNIT.match(name)) is not None:
        pairs += [(stem + after[2], unit) for stem, unit in _ended(after[1])]
    return [*pairs, (name, "")]


def _ended(name: str) -> list[tuple[str, str]]:
    """Return how a name divides into a stem and a unit at its end, the longest unit first."""
    lower, pairs = name.lower(), []
    for ending in _ENDINGS:
        stem = name[: len(name) - len(ending)]
        if lower.endswith(ending) and stem and (stem[-1] in "_ .-/" or len(ending) > 3):
            pairs.append((stem.rstrip("_ .-/"), _plain_unit(ending)))
    return pairs


def _plain_unit(text: str) -> str:
    return re.sub(r"(?<=[A-Za-z])(?:_per_|_)(?=(?:s|sec|h|hr|hour|min|s2|s\^2)$)", "/", text, flags=re.IGNORECASE)


def _is_unit_of(target: str, unit: str) -> bool:
    quantity = unit_of_target(target)
    if not unit:
        return True
    return is_lsb(unit) or (quantity in QUANTITIES and find_unit(quantity, unit) is not None)


def _target(stem: str) -> str:
    text = folded(stem)
    for pattern, target in _COMPILED:
        if (match := pattern.fullmatch(text)) is not None:
            return target.format(axis=match.groupdict().get("axis", ""))
    return ""
