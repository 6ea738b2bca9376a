"""Residuals against what was logged, against time, and against the rate before: running means with a 95 % band."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from labctl.answers.views import ChannelLine, DataSetColumns, MeanLine, PreviousRateLine, TimeLine
from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.diagnostics.axis import BAND, AxisView
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.data.levels import rate_levels
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain, plain_list
from labctl.recording.columns import OWN_DATASET, RECORDING

#: Data sets that are drawn one by one; a longer recording is thinned to so many.
MAX_DRAWN = 3000
#: With more strata than one in this many drawn data sets, neighbouring rates of one sign share a stratum.
MIN_PER_STRATUM = 8
GOLDEN = 0.6180339887498949


def drawn_rows(
    position: NDArray[np.str_], table_rate_dps: Array, temperature_c: Array, most: int = MAX_DRAWN
) -> NDArray[np.int64]:
    """Return which of n data sets are drawn, rising: all of them, or `most` of them.

    Strata are position and signed rate level. Each gives its data sets in an order that spreads over its
    temperatures (van der Corput), and all strata give equally many as long as they have any left.
    """
    n = len(table_rate_dps)
    if n <= most:
        return np.arange(n)
    stratum = _strata(position, table_rate_dps, max(most // MIN_PER_STRATUM, 1))
    turn = np.empty(n)
    for number in np.unique(stratum):
        rows = np.flatnonzero(stratum == number)
        warmer = rows[np.argsort(temperature_c[rows], kind="stable")]
        begin = int(number * GOLDEN % 1.0 * len(rows))  # not every stratum begins with its coldest
        turn[np.roll(warmer, begin)[_spread(len(rows))]] = np.arange(len(rows))
    return np.sort(np.lexsort((stratum, turn))[:most])


def _strata(position: NDArray[np.str_], table_rate_dps: Array, most: int) -> NDArray[np.int64]:
    """Return a number for each position and signed rate level, (n,); neighbouring rates share one beyond `most`."""
    _, place = np.unique(position, return_inverse=True)
    level = rate_levels(table_rate_dps)
    allowed = max(most // (int(place.max()) + 1), 3)
    if int(level.max()) + 1 > allowed:
        sign = np.sign(table_rate_dps).astype(np.int64)
        ranks = np.argsort(np.argsort(level, kind="stable"), kind="stable")
        _, level = np.unique(sign * (len(level) + 1) + ranks * (allowed - 2) // len(level), return_inverse=True)
    return np.asarray(place * (int(level.max()) + 1) + level, dtype=np.int64)


def _spread(n: int) -> NDArray[np.int64]:
    """Return 0 .. n-1 in an order of which every beginning is spread evenly: ranks of the van der Corput sequence."""
    bits = max(int(n - 1).bit_length(), 1)
    codes = np.arange(2**bits)
    reverse = np.zeros_like(codes)
    for k in range(bits):
        reverse |= ((codes >> k) & 1) << (bits - 1 - k)
    return np.asarray(reverse[reverse < n], dtype=np.int64)


#: Points of a running mean, and how many levels of a channel are still shown one by one.
POINTS = 24
#: A running mean is over this share of the data sets, and over no fewer than this.
SHARE = 1 / 12
LEAST = 6
#: Levels are apart by a gap of this share of the whole, and no wider than their least gap; the finest that will do.
LEVEL_GAPS = (1e-6, 1e-4, 1e-3, 1e-2)
#: Fewer data sets than this have no runs test.
MIN_FOR_RUNS = 12


def data_sets(data: ReducedRecording, axes: Sequence[AxisView]) -> DataSetColumns:
    """Return the data sets one by one as columns of equal length: what was logged, and each axis' residual.

    `of` says how many the recording has; the columns have as many, or `MAX_DRAWN` of them (`drawn_rows`). Where no
    time is known (`timed`), the channel `order` counts the data sets from 1, and there is no `t_s`.
    """
    if not axes:
        return {}
    first = axes[0]
    rows = drawn_rows(first.position(), first.channel("table_rate_dps"), first.temperature_c())
    names = {name for view in axes for name in smooth_channels(data, view.axis)} | {"table_rate_dps", "temperature_c"}
    if "previous_rate_dps" in data.nodes:
        names.add("previous_rate_dps")
    name, along = time_axis(first)
    set_columns: DataSetColumns = {
        "of": len(first),
        "timed": first.timed,
        "dataset": data.dataset[rows].tolist(),
        "position": first.position()[rows].tolist(),
        "run": first.run[rows].tolist(),
        "channels": {name: plain_list(along[rows])}
        | {name: plain_list(first.channel(name)[rows]) for name in sorted(names - {"t_s"}) if name in data.nodes},
        "residual_dps": {view.axis: plain_list(view.residual_dps[rows]) for view in axes},
        "over_floor": {view.axis: plain_list(view.over_floor[rows]) for view in axes},
    }
    if RECORDING in data.nodes:
        set_columns["recording"] = _numbers(first.channel(RECORDING)[rows])
        set_columns["own_dataset"] = _numbers(first.channel(OWN_DATASET)[rows])
    return set_columns


def _numbers(values: Array) -> list[int]:
    return [int(number) for number in np.rint(values)]


def time_axis(view: AxisView) -> tuple[str, Array]:
    """Return the channel along which data sets follow each other, and its values (m,): `t_s`, or `order` from 1."""
    return ("t_s", view.t_s) if view.timed else ("order", np.arange(1.0, len(view) + 1))


def channel_lines(view: AxisView) -> Iterator[ChannelLine]:
    """Yield a running mean against each channel that varies; against the table's rate one for each position."""
    everywhere = np.ones(len(view), dtype=bool)
    for name in smooth_channels(view.data, view.axis):
        if name not in {"t_s", "table_rate_dps"}:
            yield _channel_line(view, name, running_mean(view, view.channel(name), everywhere))
    position, rate = view.position(), view.channel("table_rate_dps")
    for up_position in np.unique(position):
        in_position = position == up_position
        if np.ptp(rate[in_position]) > 0:
            line = _channel_line(view, "table_rate_dps", running_mean(view, rate, in_position))
            line["position"] = str(up_position)
            yield line


def _channel_line(view: AxisView, channel: str, mean: MeanLine) -> ChannelLine:
    return {
        "axis": view.axis, "channel": channel, "at": mean["at"], "mean_dps": mean["mean_dps"],
        "low_dps": mean["low_dps"], "high_dps": mean["high_dps"], "z": mean["z"],
    }  # fmt: skip


def running_mean(view: AxisView, values: Array, inside: NDArray[np.bool_]) -> MeanLine:
    """Return the mean residual along a channel (m,), where `inside`, with a 95 % band that includes the drift.

    A channel of few levels has a point for each; another a running mean.
    """
    rows = np.flatnonzero(inside)
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


def previous_rate(view: AxisView) -> PreviousRateLine | None:
    """Return the residual against the rate before; None where it is not known."""
    if "previous_rate_dps" not in view.data.nodes:
        return None
    values = view.channel("previous_rate_dps")
    if not np.ptp(values) > 0:
        return None
    return {"axis": view.axis, **running_mean(view, values, np.ones(len(view), dtype=bool))}


def time_line(view: AxisView) -> TimeLine:
    """Return the residual against time, the power-ons, and whether neighbouring residuals are correlated.

    Where no time is known it is against the order of the data sets: `order` and `power_on_order` stand for `t_s` and
    `power_on_t_s`.
    """
    begins = np.flatnonzero(np.concatenate([[True], view.run[1:] != view.run[:-1]]))
    _, along = time_axis(view)
    line = running_mean(view, along, np.ones(len(view), dtype=bool))
    z, p = runs_test(view.whitened)
    line_json: TimeLine = {
        "axis": view.axis,
        "mean_dps": line["mean_dps"],
        "low_dps": line["low_dps"],
        "high_dps": line["high_dps"],
        "z": line["z"],
        "lag1": plain(_lag1(view.residual_dps, view.run)),
        "lag1_whitened": plain(_lag1(view.whitened, view.run)),
        "runs_z": plain(z),
        "runs_p": plain(p),
    }
    if view.timed:
        line_json["t_s"], line_json["power_on_t_s"] = line["at"], plain_list(along[begins])
    else:
        line_json["order"], line_json["power_on_order"] = line["at"], plain_list(along[begins])
    return line_json


def runs_test(values: Array) -> tuple[float, float]:
    """Return z and p (two-sided) of the number of runs above and below the median (Wald and Wolfowitz).

    Negative z: fewer runs than chance, neighbours are alike. (nan, nan) for fewer than 12 values.
    """
    above = values > np.median(values)
    n1, n2 = int(above.sum()), int((~above).sum())
    if len(values) < MIN_FOR_RUNS or not n1 or not n2:
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
