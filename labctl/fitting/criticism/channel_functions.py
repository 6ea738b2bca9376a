"""Smooth functions of logged channels, which compete with the effects: a residual may follow an unnamed channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.joined import trend_t_s
from labctl.fitting.effects.acceleration import MIN_CHANGE_G, change_g
from labctl.fitting.numeric.arrays import Array
from labctl.recording.columns import OWN_DATASET, RATE_TIME_U, READING_TIMES, RECORDING, WITHIN_S

#: Knots of a smooth function of a channel: a coarse and a fine one compete.
KNOTS = (5, 9)
#: Steps and waves over the range of a channel of the surroundings: shapes of one and two coefficients, where the
#: evidence would not carry a smooth function of nine.
STEPS_AT = (0.2, 0.35, 0.5, 0.65, 0.8)
WAVES_OVER_RANGE = (1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0)
STEPS_IN_TIME = tuple(float(at) for at in np.arange(0.1, 0.91, 0.05))
#: The same over time: down to an hour in a campaign of a day.
WAVES_OVER_TIME = tuple(float(n) for n in np.arange(1.5, 12.1, 0.5))
#: A jump is spread over this share of the range.
SPREAD = 0.1
SHARP = 0.03
#: Time constants of a decay of the scale factor after power-on, s: beyond what any effect has, too.
DECAYS_S = tuple(float(tau) for tau in np.geomspace(900.0, 28800.0, 6))
#: Columns that are no physical channel: counters, the gyro's own output, and places within a data set.
NO_CHANNELS = frozenset(
    {
        "dataset", "run", "mounting", "n", "valid", "duration_s", "since_begin_s", "previous_rate_dps", "status",
        "table_angle_deg", "chamber_setpoint_c", "temperature_x_c", "temperature_y_c", "temperature_z_c",
        "turn_deg", "turn_u_deg", "computed_rate_dps", "encoder_rate_dps", "encoder_rate_u_dps",
        RECORDING, WITHIN_S, OWN_DATASET, *READING_TIMES, *RATE_TIME_U,
    }
)  # fmt: skip
FORCES = {"x": "accel_x_g", "y": "accel_y_g", "z": "accel_z_g"}
TIMES = frozenset({"t_s", "power_s"})
OF_TEMPERATURE_AND_TIME = TIMES | {"temperature_c"}
#: Channels whose straight line is an effect, or in the base.
OF_BASE_AND_TIME = OF_TEMPERATURE_AND_TIME | {"table_rate_dps"}
#: Time since power-on counts as time where their difference changes by less than this.
SAME_TIME_S = 1.0
#: Channels without steps and waves: the rate, and the time since power-on, as time has its own.
NO_SURROUNDINGS = frozenset({"table_rate_dps", "power_s"})


def smooth_channels(data: ReducedRecording, axis: str) -> dict[str, Array]:
    """Return channel -> values at the nodes (m * B,) of every numeric channel that varies."""
    channels = {
        name: np.asarray(values, dtype=np.float64)
        for name, values in data.nodes.columns.items()
        if name not in NO_CHANNELS and values.dtype.kind in "fiu" and not name.startswith("gyro_")
    }
    for body, name in FORCES.items():
        if name in channels and change_g(data.nodes, body) < MIN_CHANGE_G:  # a support that leans, and no cause
            del channels[name]
    channels["table_rate_dps"] = data.nodes.rate_dps(axis)
    if "t_s" in channels:
        channels["t_s"] = trend_t_s(data.info, data.nodes.columns)
    if data.info.motion == "turns":  # no function of the rate can be found from its mean
        del channels["table_rate_dps"]
    return {name: v for name, v in channels.items() if np.all(np.isfinite(v)) and np.ptp(v) > 1e-9 * (1 + abs(v[0]))}


def channel_options(data: ReducedRecording, axis: str) -> list[CandidateShape]:
    """Return piecewise linear functions, steps and waves of every channel that varies, for one axis.

    Each as bias and as scale factor, and those of temperature also as both together. The time since power-on is left
    out where it differs from time only by a constant.
    """
    shapes = []
    channels = smooth_channels(data, axis)
    if "power_s" in channels:
        same = "t_s" in channels and np.ptp(channels["t_s"] - channels["power_s"]) < SAME_TIME_S
        shapes += _decays(data, axis, "t_s" if same else "power_s", channels["power_s"])
        if same:
            del channels["power_s"]
    for name, values in channels.items():
        if name not in OF_BASE_AND_TIME:
            shapes += _line(data, axis, name, values)
        for number in KNOTS:
            shapes += _smooth(data, axis, name, values, number)
        distinct = np.unique(np.round(values, 9))
        if name not in NO_SURROUNDINGS and len(distinct) > max(KNOTS):
            shapes += _steps(
                data, axis, name, values, np.quantile(distinct, STEPS_IN_TIME if name in TIMES else STEPS_AT)
            )
            shapes += _waves(data, name, values, WAVES_OVER_TIME if name in TIMES else WAVES_OVER_RANGE)
    return shapes


def _steps(data: ReducedRecording, axis: str, name: str, values: Array, places: Array) -> list[CandidateShape]:
    """Return steps of a channel, of the bias, and in time, where a step is sharp, of the scale factor."""
    half = (SHARP if name in TIMES else SPREAD) * np.ptp(values) / 2
    step_shapes = []
    for place in places:
        step = np.clip((values - place) / half, -1.0, 1.0)[:, None]
        step_shapes.append(CandidateShape(name, None, data.rows_of(step), (f"{name}>{place:.6g}",), ("deg/s",)))
        if name in TIMES:
            scaled = data.rows_of(step * data.nodes.rate_dps(axis)[:, None])
            step_shapes.append(CandidateShape(name, None, scaled, (f"{name}>{place:.6g} x rate",), ("1",)))
    return step_shapes


def _waves(data: ReducedRecording, name: str, values: Array, over_range: tuple[float, ...]) -> list[CandidateShape]:
    phase = 2 * np.pi * (values - values.min()) / np.ptp(values)
    names, units = (f"cos {name}", f"sin {name}"), ("deg/s", "deg/s")
    return [
        CandidateShape(name, None, data.rows_of(np.column_stack([np.cos(n * phase), np.sin(n * phase)])), names, units)
        for n in over_range
    ]


def _line(data: ReducedRecording, axis: str, name: str, values: Array) -> list[CandidateShape]:
    """Return a channel itself, as bias and as scale factor."""
    line = ((values - values.mean()) / np.ptp(values))[:, None]
    return [
        CandidateShape(name, None, data.rows_of(line), (name,), ("deg/s",)),
        CandidateShape(
            name, None, data.rows_of(line * data.nodes.rate_dps(axis)[:, None]), (f"{name} x rate",), ("1",)
        ),
    ]


def _decays(data: ReducedRecording, axis: str, name: str, power_s: Array) -> list[CandidateShape]:
    """Return decays of the scale factor after power-on."""
    since, rate = np.maximum(power_s, 0.0), data.nodes.rate_dps(axis)
    return [
        CandidateShape(
            name,
            None,
            data.rows_of((np.exp(-since / tau) * rate)[:, None]),
            (f"exp(-{name}/{tau:.0f}) x rate",),
            ("1",),
            beside_base=True,
        )
        for tau in DECAYS_S
    ]


def hats(values: Array, number: int) -> NDArray[np.float64] | None:
    """Return piecewise linear functions of a channel (n,) with so many knots but one, (n, k); None with too few values.

    The first knot's is left out: the sum of all is a constant.
    """
    knots = _knots(values, number)
    if len(knots) < 3:
        return None
    return np.column_stack([np.interp(values, knots, np.eye(len(knots))[k]) for k in range(1, len(knots))])


def _knots(values: Array, number: int) -> Array:
    return np.unique(np.quantile(np.unique(np.round(values, 9)), np.linspace(0, 1, number)))


def _smooth(data: ReducedRecording, axis: str, name: str, values: Array, number: int) -> list[CandidateShape]:
    """Return a piecewise linear function of a channel as bias, as scale factor, and as both."""
    functions = hats(values, number)
    if functions is None:
        return []
    names = tuple(f"{name}@{knot:.6g}" for knot in _knots(values, number)[1:])
    bias = CandidateShape(name, None, data.rows_of(functions), names, ("deg/s",) * len(names))
    if name == "table_rate_dps" or (number == max(KNOTS) and name not in OF_TEMPERATURE_AND_TIME):
        return [bias]
    scaled = data.rows_of(functions * data.nodes.rate_dps(axis)[:, None])
    scale = CandidateShape(name, None, scaled, tuple(f"{each} x rate" for each in names), ("1",) * len(names))
    if name != "temperature_c":
        return [bias, scale]
    columns_of_both = np.concatenate([bias.rows, scale.rows], axis=2)
    return [
        bias,
        scale,
        CandidateShape(name, None, columns_of_both, bias.names + scale.names, bias.units + scale.units),
    ]
