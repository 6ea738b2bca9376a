"""What moved a unit, by the columns that a log has and by its readings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Motion
from labctl.probability_text import share_text
from labctl.recording.column_map.movement import Movement, poses
from labctl.recording.columns import BY_NAME, needed
from labctl.recording.info import RecordingInfo
from labctl.recording.motions.constant_rate import rate_change
from labctl.recording.recording import Columns
from labctl.recording.sanity.finding import Finding

Array = NDArray[np.float64]
#: Poses that gravity distinguishes, from which on a gyro can be calibrated by them (imu_tk asks for 9 and more).
MIN_POSES = 6
#: Findings of a log that is refused that are named, at most.
MAX_NAMED = 3


def motion_of(columns: Columns, kind: str, movement: Movement, t_s: Array) -> Motion | None:
    """Return what moved the unit; None where it moved and nothing in the columns says how."""
    if "turn_deg" in columns:
        return "turns"
    if "table_rate_dps" in columns:
        rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
        if kind == "points":
            return "rates"
        valid = np.ones(len(rate), dtype=np.bool_)
        change = rate_change(np.asarray(columns["dataset"], dtype=np.int64), rate, valid)
        return "rates" if change is None else "profile"
    if movement.is_rest:
        return "rest"
    return "poses" if _poses(columns, movement, t_s) >= MIN_POSES else None


def free_motion(columns: Columns, movement: Movement, t_s: Array, at_rest: Sequence[Finding]) -> str:
    """Return why a log of a unit that moved cannot be used, and what would do instead, as one sentence.

    `at_rest` is what an inspection of the readings finds if the unit is taken to rest.
    """
    n = _poses(columns, movement, t_s)
    poses_text = f"; its accelerometer shows {n} poses at rest, {MIN_POSES} are needed" if n else ""
    spread = f"its output varies by {movement.spread_dps:.3g} deg/s"
    return (
        f"the unit moves in {share_text(movement.share)} of the time ({spread}) and no column gives the rate or the "
        f"angle{poses_text}: free motion without a reference cannot calibrate a gyro; add a column with the table's "
        "rate "
        "(table_rate_dps), the angle of each turn (turn_deg), an accelerometer with rests in at least "
        f"{MIN_POSES} poses (accel_x_g, accel_y_g, accel_z_g), or a log at rest; if the unit was to rest, write "
        f'motion = "rest" in a map{_named(at_rest)}'
    )


def _named(findings: Sequence[Finding]) -> str:
    findings_text = "; ".join(f"{finding.what}: {finding.where}: {finding.said}" for finding in findings[:MAX_NAMED])
    more = f"; and {len(findings) - MAX_NAMED} more" if len(findings) > MAX_NAMED else ""
    return f". If the unit rested, this is wrong with its readings: {findings_text}{more}" if findings else ""


def missing_columns(info: RecordingInfo, columns: Columns) -> list[str]:
    """Return a line for each column that a recording of this motion needs and that is not there."""
    lines = []
    for name in needed(info):
        if name in columns:
            continue
        advice = f"write [columns.{name}]"
        if name == "position":
            advice = 'write [constants] position = "z" (the body axis along the table axis), or a column of it'
        elif name in {"turn_deg", "table_rate_dps", "temperature_c"}:
            advice += f", or {name} in [constants] or in [parts.NAME]"
        lines.append(f"no {name} ({BY_NAME[name].meaning}), needed for motion = {info.motion!r}; {advice}")
    return lines


def _poses(columns: Columns, movement: Movement, t_s: Array) -> int:
    names = [f"accel_{axis}_g" for axis in "xyz"]
    if any(name not in columns for name in names):
        return 0
    return poses(movement, t_s, np.column_stack([np.asarray(columns[name], dtype=np.float64) for name in names]))
