"""Single data sets that disagree with all others: a flipped sign, a wrong rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.recording.positions import Position
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.gain import POSSIBLE
from labctl.recording.sanity.response import ROBUST, Response
from labctl.recording.sanity.summary import Summary

#: Data sets of a position below which none can be said to disagree.
MIN_SETS = 6
#: A data set disagrees when it is this many times the usual scatter off, and more than this share of the fastest rate;
#: where its output is that of another rate of the schedule, a smaller share is enough.
SCATTERS, GROSS_SHARE, SMALL_SHARE = 12.0, 0.05, 0.01
#: Rates closer than this share of the fastest are one.
SAME_RATE = 2e-3
#: More than this share of data sets off is no longer a matter of single ones.
MAX_SHARE = 0.25
#: The output's rate is that of the schedule when it is so many scatters, or this share of the fastest rate, from it.
MATCH_SCATTERS, MATCH_SHARE = 4.0, 5e-3
#: Different data sets that are reported one by one.
MAX_REPORTED = 5


def check_outlying(summary: Summary, responses_by_axis: Mapping[str, Mapping[str, Response]]) -> Iterator[Finding]:
    """Yield each data set whose output belongs to another rate than it has."""
    for position, outputs in responses_by_axis.items():
        axis = Position.of(position).axis
        one = outputs.get(axis)
        if one is None or not POSSIBLE[0] <= abs(one.gain) <= POSSIBLE[1] or int(one.rows.sum()) < MIN_SETS:
            continue
        yield from _of_response(summary.take(one.rows), one)


def _of_response(sets: Summary, response: Response) -> Iterator[Finding]:
    rate = np.asarray(sets["table_rate_dps"], dtype=np.float64)
    fast = float(np.abs(rate).max())
    off = local_difference(rate, response.residual_dps, SAME_RATE * fast)
    scatter = local_scatter(rate, off)
    noise = sets.of_axis("noise", response.output) / np.sqrt(np.maximum(np.asarray(sets["n"], dtype=np.float64), 1.0))
    scatter = np.maximum(scatter, np.nan_to_num(noise))
    scatter = np.maximum(scatter, 1e-5 * fast)
    meant = rate + off / response.gain
    far = np.abs(off) > SCATTERS * scatter
    tolerance = np.maximum(MATCH_SCATTERS * scatter, MATCH_SHARE * fast)
    rate_bins = np.unique(np.concatenate([rate, -rate, [0.0]]))
    distance = np.abs(meant[:, None] - rate_bins[None, :])
    distance[np.abs(rate[:, None] - rate_bins[None, :]) <= tolerance[:, None]] = np.inf
    matches = distance.min(axis=1) <= tolerance
    gross = far & (np.abs(off) > GROSS_SHARE * fast)
    small = far & matches & (np.abs(off) > SMALL_SHARE * fast)
    rows = np.flatnonzero(gross | small)
    if len(rows) > MAX_SHARE * len(rate):
        return
    for row in rows[np.argsort(-np.abs(off[rows]))][:MAX_REPORTED]:
        yield _finding(sets, response, int(row), float(meant[row]), certain=bool(gross[row] and matches[row]))
    if len(rows) > MAX_REPORTED:
        yield _rest(sets, response, len(rows) - MAX_REPORTED)


def _finding(sets: Summary, response: Response, row: int, meant: float, *, certain: bool) -> Finding:
    rate, number = float(sets["table_rate_dps"][row]), int(sets["dataset"][row])
    flipped = abs(meant + rate) < 0.1 * abs(rate)
    text = (
        f"the rate is given as {rate:.6g} deg/s, but the output shows {meant:.4g} deg/s, while all other data sets "
        "agree with each other"
    )
    cause = "the sign of the rate or of the output" if flipped else "the rate or the number of the data set"
    return Finding(
        "one_data_set", "certain" if certain else "likely", f"data set {number}, axis {response.output}", text,
        meant, "deg/s", f"{rate:.6g} deg/s", f"correct {cause}, or leave the data set out",
    )  # fmt: skip


def _rest(sets: Summary, response: Response, more: int) -> Finding:
    return Finding(
        "one_data_set", "likely", f"axis {response.output}, position {response.position}",
        f"besides the data sets listed above, {more} of {len(sets)} data sets disagree with the others",
        float(more), "data sets", "none",
        "correct the data sets listed above first, then check again",
    )  # fmt: skip


def local_difference(rate: NDArray[np.float64], residual: NDArray[np.float64], level: float) -> NDArray[np.float64]:
    """Return residuals (n,) less the median of those at the same rate, or where it is alone of those at its neighbours.

    A law that bends with the rate leaves the same residual at the same rate; it is no data set that disagrees.
    """
    group = np.round(rate / max(level, 1e-9)).astype(np.int64)
    levels, index, count = np.unique(group, return_inverse=True, return_counts=True)
    medians = np.array([np.median(residual[index == k]) for k in range(len(levels))])
    expected = medians[index]
    for k in np.flatnonzero(count < 3):
        near = [j for j in (k - 2, k - 1, k + 1, k + 2) if 0 <= j < len(levels)]
        expected[index == k] = np.median(medians[near]) if near else 0.0
    return np.asarray(residual - expected)


def local_scatter(rate: NDArray[np.float64], difference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the usual size of differences (n,) at each data set's rate, never below that of all."""
    overall = ROBUST * float(np.median(np.abs(difference)))
    order = np.argsort(np.abs(rate), kind="stable")
    scatter = np.full(len(difference), overall)
    for part in np.array_split(order, min(max(len(difference) // 8, 1), 4)):
        scatter[part] = max(overall, ROBUST * float(np.median(np.abs(difference[part]))))
    return scatter
