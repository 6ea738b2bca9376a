"""Residuals against what was logged, against time, and against the rate before: running means with a 95 % band."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.diagnostics.axis import BAND, AxisView
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain, plain_list

#: Points of a running mean, and how many levels of a channel are still shown one by one.
POINTS = 24
#: A running mean is over this share of the data sets, and over no fewer than this.
SHARE = 1 / 12
LEAST = 6
#: Levels are apart by a gap of this share of the whole, and no wider than their least gap; the finest that will do.
LEVEL_GAPS = (1e-6, 1e-4, 1e-3, 1e-2)
#: Data sets that are given one by one; evenly picked when there are more.
MOST_SETS = 300
#: Fewer data sets than this have no runs test.
LEAST_FOR_RUNS = 12


def data_sets(data: ReducedRecording, axes: Sequence[AxisView]) -> dict[str, Any]:
    """Return the data sets one by one as columns of equal length: what was logged, and each axis' residual."""
    if not axes:
        return {}
    first = axes[0]
    rows = np.unique(np.linspace(0, len(first) - 1, min(len(first), MOST_SETS)).round().astype(np.int64))
    names = {name for view in axes for name in smooth_channels(data, view.axis)} | {"table_rate_dps", "temperature_c"}
    if "previous_rate_dps" in data.nodes:
        names.add("previous_rate_dps")
    return {
        "of": len(first),
        "timed": "t_s" in data.nodes,  # else the order of rows stands for time
        "dataset": data.dataset[rows].tolist(),
        "position": first.position()[rows].tolist(),
        "run": first.run[rows].tolist(),
        "channels": {"t_s": plain_list(first.t_s[rows])}
        | {name: plain_list(first.channel(name)[rows]) for name in sorted(names) if name in data.nodes},
        "residual_dps": {view.axis: plain_list(view.residual_dps[rows]) for view in axes},
        "over_floor": {view.axis: plain_list((view.residual_dps / view.floor_dps)[rows]) for view in axes},
    }


def channel_lines(view: AxisView) -> Iterator[dict[str, Any]]:
    """Yield a running mean against each channel that varies; against the table's rate one for each position."""
    everywhere = np.ones(len(view), dtype=bool)
    for name in smooth_channels(view.data, view.axis):
        if name not in {"t_s", "table_rate_dps"}:
            yield {"axis": view.axis, "channel": name, **running_mean(view, view.channel(name), everywhere)}
    position, rate = view.position(), view.channel("table_rate_dps")
    for there in np.unique(position):
        here = position == there
        if np.ptp(rate[here]) > 0:
            line = running_mean(view, rate, here)
            yield {"axis": view.axis, "channel": "table_rate_dps", "position": str(there), **line}


def running_mean(view: AxisView, values: Array, here: NDArray[np.bool_]) -> dict[str, Any]:
    """Return the mean residual along a channel (m,), where `here`, with a band that knows of the drift.

    A channel of few levels has a point for each; another a running mean.
    """
    rows = np.flatnonzero(here)
    groups = [rows[group] for group in groups_of(values[rows])]
    weights = np.zeros((len(groups), len(view)))
    for k, group in enumerate(groups):
        weights[k, group] = 1.0 / len(group)
    mean, u = weights @ view.residual_dps, view.u_dps(weights)
    return {
        "at": plain_list(weights @ values),
        "mean_dps": plain_list(mean),
        "low_dps": plain_list(mean - BAND * u),
        "high_dps": plain_list(mean + BAND * u),
        "z": plain(np.max(np.abs(mean) / u)),
    }


def groups_of(values: Array) -> list[NDArray[np.int64]]:
    """Return which of values (n,) to average: the few levels that there are, or windows that move along."""
    order = np.argsort(values, kind="stable")
    if not np.ptp(values) > 0:
        return [order]
    for share in LEVEL_GAPS:
        begins = np.flatnonzero(np.diff(values[order]) > share * np.ptp(values)) + 1
        if 0 < len(begins) < POINTS:
            groups = np.split(order, begins)
            widest = max(float(np.ptp(values[group])) for group in groups)
            if widest <= np.diff(values[order])[begins - 1].min():
                return groups
    width = min(max(round(SHARE * len(order)), LEAST), len(order))
    begins = np.unique(np.linspace(0, len(order) - width, POINTS).round().astype(np.int64))
    return [order[begin : begin + width] for begin in begins]


def previous_rate(view: AxisView) -> dict[str, Any] | None:
    """Return the residual against the rate before; None where it is not known."""
    if "previous_rate_dps" not in view.data.nodes:
        return None
    values = view.channel("previous_rate_dps")
    if not np.ptp(values) > 0:
        return None
    return {"axis": view.axis, **running_mean(view, values, np.ones(len(view), dtype=bool))}


def time_line(view: AxisView) -> dict[str, Any]:
    """Return the residual against time, where power came, and whether neighbours hang together."""
    begins = np.flatnonzero(np.concatenate([[True], view.run[1:] != view.run[:-1]]))
    line = running_mean(view, view.t_s, np.ones(len(view), dtype=bool))
    z, p = runs_test(view.whitened)
    return {
        "axis": view.axis,
        **{("t_s" if name == "at" else name): values for name, values in line.items()},
        "power_on_t_s": plain_list(view.t_s[begins]),
        "lag1": plain(_lag1(view.residual_dps, view.run)),
        "lag1_whitened": plain(_lag1(view.whitened, view.run)),
        "runs_z": plain(z),
        "runs_p": plain(p),
    }


def runs_test(values: Array) -> tuple[float, float]:
    """Return z and p (two-sided) of the number of runs above and below the median (Wald and Wolfowitz).

    Negative z: fewer runs than chance, neighbours are alike. (nan, nan) for fewer than 12 values.
    """
    above = values > np.median(values)
    n1, n2 = int(above.sum()), int((~above).sum())
    if len(values) < LEAST_FOR_RUNS or not n1 or not n2:
        return float("nan"), float("nan")
    n = n1 + n2
    runs = 1 + int(np.sum(above[1:] != above[:-1]))
    expected = 1 + 2 * n1 * n2 / n
    variance = 2 * n1 * n2 * (2 * n1 * n2 - n) / (n**2 * (n - 1))
    z = (runs - expected) / np.sqrt(variance)
    return float(z), float(2 * ndtr(-abs(z)))


def _lag1(values: Array, run: NDArray[np.int64]) -> float:
    """Return the correlation of neighbours within powered runs; nan without any."""
    pairs = run[1:] == run[:-1]
    centred = values - values.mean()
    power = float(np.mean(centred**2))
    if pairs.sum() < 2 or power <= 0:
        return float("nan")
    return float(np.mean((centred[1:] * centred[:-1])[pairs]) / power)
