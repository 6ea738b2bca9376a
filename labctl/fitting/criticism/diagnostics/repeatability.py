"""Data sets that should agree: the same temperature from below and from above, and the same point measured again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labctl.answers.views import LegLine, Repeats
from labctl.fitting.criticism.diagnostics.axis import BAND, AxisView
from labctl.fitting.criticism.diagnostics.channels import groups_of
from labctl.fitting.data.noise_floor import REPEAT_RATE, REPEAT_TEMPERATURE_C
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.json_numbers import plain, plain_list

#: Least change of the temperature in the other direction that counts as a reversal, K.
TURN_K = 2.0
#: Data sets reached from below and from above are compared at temperatures as close as this.
SAME_TEMPERATURE_K = 2.0
#: Largest number of pairs that are drawn; of more, a selection over all sizes of the difference.
MAX_PAIRS = 3000


def hysteresis_states(temperature_c: Array, run: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return from which side the temperature of each data set was reached, (m,): 1 below, -1 above, 0 unknown."""
    side = np.zeros(len(temperature_c), dtype=np.int64)
    state, low, high = 0, 0.0, 0.0
    for i, now in enumerate(temperature_c.tolist()):
        if i == 0 or run[i] != run[i - 1]:
            state, low, high = 0, now, now
        low, high = min(low, now), max(high, now)
        if state >= 0 and high - now > TURN_K:
            state, low = -1, now
        elif state <= 0 and now - low > TURN_K:
            state, high = 1, now
        side[i] = state
    return side


def hysteresis_lines(view: AxisView) -> Iterator[LegLine]:
    """Yield the residual reached from below minus that from above at equal rate and temperature, deg/s, by channel."""
    temperature_c, rate = view.temperature_c(), view.channel("table_rate_dps")
    side = hysteresis_states(temperature_c, view.run)
    ups, downs = _matched(view, side, temperature_c, rate)
    if not len(ups):
        return
    for name, values in (
        ("temperature_c", (temperature_c[ups] + temperature_c[downs]) / 2),
        ("table_rate_dps", rate[ups]),
    ):
        groups = groups_of(values)
        weights = np.zeros((len(groups), len(view)))
        for k, group in enumerate(groups):
            np.add.at(weights[k], ups[group], 1.0 / len(group))
            np.add.at(weights[k], downs[group], -1.0 / len(group))
        difference, u = weights @ view.residual_dps, view.u_dps(weights)
        yield {
            "axis": view.axis,
            "channel": name,
            "pairs": len(ups),
            "at": plain_list([values[group].mean() for group in groups]),
            "mean_dps": plain_list(difference),
            "low_dps": plain_list(difference - BAND * u),
            "high_dps": plain_list(difference + BAND * u),
            "z": plain(np.max(np.abs(difference) / np.maximum(u, 1e-300))),
        }


def _matched(
    view: AxisView, side: NDArray[np.int64], temperature_c: Array, rate: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return data sets reached from below, each with the one from above that is nearest at its rate and position."""
    position, near = view.position(), REPEAT_RATE * max(float(np.abs(rate).max()), 1e-9)
    ups, downs = [], []
    down = np.flatnonzero(side < 0)
    for i in np.flatnonzero(side > 0) if len(down) else ():
        same = down[(position[down] == position[i]) & (np.abs(rate[down] - rate[i]) <= near)]
        if len(same):
            nearest = same[np.argmin(np.abs(temperature_c[same] - temperature_c[i]))]
            if abs(temperature_c[nearest] - temperature_c[i]) <= SAME_TEMPERATURE_K:
                ups.append(i)
                downs.append(nearest)
    return np.array(ups, dtype=np.int64), np.array(downs, dtype=np.int64)


def repeats(view: AxisView) -> Repeats | None:
    """Return how far data sets at one rate, temperature and position scatter; None without any.

    The floor is the expected difference by noise and drift of two data sets at that distance in time. `apart_s` is
    present only where times are known.
    """
    temperature_c, rate, position = view.temperature_c(), view.channel("table_rate_dps"), view.position()
    near = REPEAT_RATE * max(float(np.abs(rate).max()), 1e-9)
    order = np.lexsort((temperature_c, np.round(rate / near), position))
    first, second = order[:-1], order[1:]
    close = (
        (position[first] == position[second])
        & (np.abs(rate[first] - rate[second]) <= near)
        & (np.abs(temperature_c[first] - temperature_c[second]) <= REPEAT_TEMPERATURE_C)
    )
    first, second = first[close], second[close]
    if not len(first):
        return None
    difference = view.residual_dps[second] - view.residual_dps[first]
    variance = np.diag(view.covariance)
    expected = variance[first] + variance[second] - 2 * view.covariance[first, second]
    floor = float(np.sqrt(np.mean(expected) / 2))
    scatter = float(np.sqrt(np.mean(difference**2) / 2))
    everything = np.arange(len(first))
    pairs_shown = (
        everything if len(first) <= MAX_PAIRS else np.sort(np.argsort(difference)[_evenly(len(first), MAX_PAIRS)])
    )
    repeats_json: Repeats = {
        "axis": view.axis,
        "pairs": len(first),
        "scatter_dps": plain(scatter),
        "floor_dps": plain(floor),
        "over_floor": plain(scatter / floor) if floor > 0 else None,
        "datasets": [[int(a), int(b)] for a, b in view.data.dataset[np.stack([first, second], axis=1)[pairs_shown]]],
        "apart_sets": np.abs(second - first)[pairs_shown].tolist(),
        "difference_dps": plain_list(difference[pairs_shown]),
    }
    if view.timed:
        repeats_json["apart_s"] = plain_list(np.abs(view.t_s[second] - view.t_s[first])[pairs_shown])
    return repeats_json


def _evenly(n: int, most: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, n - 1, most).round().astype(np.int64))
