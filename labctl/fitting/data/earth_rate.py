"""The Earth turns the table too: a constant part along the table axis, and a part that goes round with the table."""

from __future__ import annotations

import math

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.numeric.arrays import Array
from labctl.recording import RecordingInfo
from labctl.recording.positions import Position

EARTH_RATE_DPS = 15.041067 / 3600.0  #: sidereal


def up_rate_dps(info: RecordingInfo) -> float:
    """Return the Earth's rate along the table axis, deg/s; 0 where the latitude is not known."""
    if info.latitude_deg is None:
        return 0.0
    latitude = math.radians(info.latitude_deg)
    tilt, azimuth = math.radians(info.tilt_deg or 0.0), math.radians(info.tilt_azimuth_deg or 0.0)
    up = math.sin(latitude) * math.cos(tilt) + math.cos(latitude) * math.sin(tilt) * math.cos(azimuth)
    return EARTH_RATE_DPS * up


def turning_size_dps(info: RecordingInfo) -> float:
    """Return the size of the Earth's rate that goes round with the table, deg/s; 0 where the latitude is not known."""
    return 0.0 if info.latitude_deg is None else EARTH_RATE_DPS * math.cos(math.radians(info.latitude_deg))


def turning_columns(info: RecordingInfo, channels: Channels, axis: str) -> Array:
    """Return the once-per-turn Earth rate's regressors of an output axis, (n, k): a cosine and a sine per position.

    Its size is known (the Earth's rate times the cosine of the latitude) but not where north lies from the table's
    zero, so both are fitted and belong to the environment. An axis along the table axis has none. Needs the table angle
    and the length of the data sets; k is 0 without them, and for turns, whose angle at each instant is not known.
    """
    has_course = info.latitude_deg is not None and "table_angle_deg" in channels and "duration_s" in channels
    if info.motion == "turns" or not has_course:
        return np.zeros((len(channels), 0))
    start = np.deg2rad(np.asarray(channels["table_angle_deg"], dtype=np.float64))
    angle_rad = np.deg2rad(channels.table_rate_dps() * np.asarray(channels["duration_s"], dtype=np.float64))
    middle, half = start + angle_rad / 2, angle_rad / 2
    shrink = np.sinc(half / np.pi)  # the mean of a cosine over what was turned
    cosine, sine = np.cos(middle) * shrink, np.sin(middle) * shrink
    turning = []
    for up_position, rows in channels.positions():
        if Position.of(up_position).axis != axis:
            for part in channels.by_recording(rows):  # the table's zero may point elsewhere on another day
                turning += [np.where(part, cosine, 0.0), np.where(part, sine, 0.0)]
    return np.column_stack(turning) if turning else np.zeros((len(channels), 0))
