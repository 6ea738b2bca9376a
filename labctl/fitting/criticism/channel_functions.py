"""Smooth functions of logged channels, which compete with the effects: a residual may follow an unnamed channel."""

from __future__ import annotations

import numpy as np

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.numeric.arrays import Array

#: Knots of a smooth function of a channel: a coarse and a fine one compete.
KNOTS = (5, 9)
#: Steps and waves over the range of a channel of the surroundings: shapes of one and two coefficients, where the
#: evidence would not carry a smooth function of nine.
STEPS_AT = (0.2, 0.35, 0.5, 0.65, 0.8)
WAVES_OVER_RANGE = (1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0)
#: A jump is spread over this share of the range.
SPREAD = 0.1
#: Columns that are no physical channel: counters, the gyro's own output, and places within a data set.
NO_CHANNELS = frozenset(
    {
        "dataset", "run", "mounting", "n", "valid", "duration_s", "since_begin_s", "previous_rate_dps", "status",
        "table_angle_deg", "chamber_setpoint_c", "temperature_x_c", "temperature_y_c", "temperature_z_c",
    }
)  # fmt: skip
TIMES = frozenset({"t_s", "power_s"})
NO_SURROUNDINGS = TIMES | {"table_rate_dps"}


def smooth_channels(data: ReducedRecording, axis: str) -> dict[str, Array]:
    """Return channel -> values at the nodes (m * B,) of every numeric channel that varies."""
    channels = {
        name: np.asarray(values, dtype=np.float64)
        for name, values in data.nodes.columns.items()
        if name not in NO_CHANNELS and values.dtype.kind in "fiu" and not name.startswith("gyro_")
    }
    channels["table_rate_dps"] = data.nodes.rate_dps(axis)
    return {name: v for name, v in channels.items() if np.all(np.isfinite(v)) and np.ptp(v) > 1e-9 * (1 + abs(v[0]))}


def channel_options(data: ReducedRecording, axis: str) -> list[CandidateShape]:
    """Return piecewise linear functions, steps and waves of every channel that varies, for one axis."""
    found = []
    for name, values in smooth_channels(data, axis).items():
        distinct = np.unique(np.round(values, 9))
        for number in KNOTS:
            found += _smooth(data, name, values, np.unique(np.quantile(distinct, np.linspace(0, 1, number))))
        if name not in NO_SURROUNDINGS and len(distinct) > max(KNOTS):
            found += _steps(data, name, values, np.quantile(distinct, STEPS_AT))
            found += _waves(data, name, values)
    return found


def _steps(data: ReducedRecording, name: str, values: Array, places: Array) -> list[CandidateShape]:
    half = SPREAD * np.ptp(values) / 2
    return [
        CandidateShape(
            name, None, data.rows_of(np.clip((values - place) / half, -1.0, 1.0)[:, None]),
            (f"{name}>{place:.6g}",), ("deg/s",),
        )
        for place in places
    ]  # fmt: skip


def _waves(data: ReducedRecording, name: str, values: Array) -> list[CandidateShape]:
    phase = 2 * np.pi * (values - values.min()) / np.ptp(values)
    names, units = (f"cos {name}", f"sin {name}"), ("deg/s", "deg/s")
    return [
        CandidateShape(name, None, data.rows_of(np.column_stack([np.cos(n * phase), np.sin(n * phase)])), names, units)
        for n in WAVES_OVER_RANGE
    ]


def _smooth(data: ReducedRecording, name: str, values: Array, knots: Array) -> list[CandidateShape]:
    if len(knots) < 3:
        return []
    hats = np.column_stack([np.interp(values, knots, np.eye(len(knots))[k]) for k in range(1, len(knots))])
    names = tuple(f"{name}@{knot:.6g}" for knot in knots[1:])
    return [CandidateShape(name, None, data.rows_of(hats), names, ("deg/s",) * len(names))]
