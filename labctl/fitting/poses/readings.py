"""Readings of a recording in poses: time, specific force and gyro output, all three axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, RecordingInfo
from labctl.recording.recording import temperature_of

AXES: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
#: A data set in poses has at least so many readings: two rests of a second and a turn between them, at 10 Hz.
MIN_READINGS = 30
#: Readings further apart than this many usual spacings have a gap between them.
GAP = 2.5


@dataclass(frozen=True)
class PoseReadings:
    """n valid readings in order of time."""

    info: RecordingInfo
    t_s: Array  #: (n,)
    accel_g: NDArray[np.float64]  #: (n, 3) as the accelerometers say, g
    gyro_dps: NDArray[np.float64]  #: (n, 3) by the nominal scale factor and offset, deg/s
    temperature_c: Array | None  #: (n,); None without a thermometer
    breaks: NDArray[np.bool_]  #: (n,) whether the time before a reading is unknown: power-on, re-mounting, gap

    def __len__(self) -> int:
        return len(self.t_s)

    @property
    def spacing_s(self) -> float:
        """The usual time between two readings, s."""
        return float(np.median(np.diff(self.t_s)))


def readings_of(recording: Recording) -> PoseReadings:
    """Return the valid readings of a recording in poses.

    Raises BadInput for another motion, for means and for fewer than three axes, NotEnoughData for too few readings.
    """
    info, serial = recording.info, recording.info.serial
    if info.motion != "poses":
        raise BadInput(
            f"{serial}: model poses needs a recording with motion = 'poses', but this recording has motion = "
            f"{info.motion!r}; choose another model"
        )
    if info.kind != "samples":
        raise BadInput(
            f"{serial}: poses need every reading of the turns (kind = 'samples'), but the recording has kind = "
            f"{info.kind!r}; import the readings"
        )
    absent = [axis for axis in AXES if axis not in info.axes]
    if absent:
        raise BadInput(
            f"{serial}: poses need gyros about x, y and z, but the recording has no column gyro_{absent[0]}; "
            "add the column"
        )
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    if np.count_nonzero(valid) < MIN_READINGS:
        raise NotEnoughData(
            f"{serial}: the recording has {np.count_nonzero(valid)} valid readings; rests and turns need at least "
            f"{MIN_READINGS}; record more"
        )
    temperature_c = temperature_of(columns)
    t_s = np.asarray(columns["t_s"], dtype=np.float64)[valid]
    return PoseReadings(
        info,
        t_s,
        np.column_stack([np.asarray(columns[f"accel_{a}_g"], dtype=np.float64)[valid] for a in AXES]),
        np.column_stack([recording.gyro_dps(a)[valid] for a in AXES]),
        None if temperature_c is None else temperature_c[valid],
        _breaks(recording, valid, t_s),
    )


def _breaks(recording: Recording, valid: NDArray[np.bool_], t_s: Array) -> NDArray[np.bool_]:
    is_break = np.zeros(len(t_s), dtype=np.bool_)
    steps = np.diff(t_s)
    is_break[1:] = steps > GAP * float(np.median(steps))
    for name in ("run", "mounting"):
        if name in recording.columns:
            values = np.asarray(recording.columns[name])[valid]
            is_break[1:] |= values[1:] != values[:-1]
    return is_break
