"""Gross faults of the rates of data sets: an output that wraps round, a rate that is ten times too small.

The statistics of `outlying` need many data sets in a position; what is off by 30 % and more shows with three that
agree.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labctl.recording.positions import Position
from labctl.recording.sanity.finding import Finding, numbers_in_words
from labctl.recording.sanity.summary import Summary
from labctl.recording.sanity.table_rate_ratio import MIN_DPS

Array = NDArray[np.float64]
#: A rate below this share of the fastest is taken as that share; data sets that must agree, and their share.
MIN_SHARE, MIN_AGREEING, AGREEING_SHARE = 0.1, 3, 0.5
#: An output disagrees that is off by this share of the rate; the jumps of one that wraps differ by at most this share.
OFF_SHARE, SAME_JUMP = 0.3, 0.03


def check_ratios(summary: Summary) -> Iterator[Finding]:
    """Yield the outputs that wrap round at the end of their range, and data sets whose rate is grossly wrong."""
    if summary.info.motion != "rates":
        return
    places = np.asarray(summary["position"]).astype(str)
    for position in dict.fromkeys(places.tolist()):
        along = Position.of(position)
        if along.axis in summary.info.axes:
            yield from _of_position(summary.take(places == position), along)


def _of_position(sets: Summary, along: Position) -> Iterator[Finding]:
    rate = along.sign * np.asarray(sets["table_rate_dps"], dtype=np.float64)
    output = np.asarray(sets.of_axis("mean", along.axis), dtype=np.float64)
    fast = float(np.abs(rate).max(initial=0.0))
    if fast < MIN_DPS or not np.isfinite(output).all():
        return
    numbers = np.asarray(sets["dataset"], dtype=np.float64)
    slow = np.abs(rate) <= MIN_SHARE * fast
    if slow.any() and (wrapped := _wrapped(along, numbers, rate, output, float(np.median((output - rate)[slow])))):
        yield wrapped
        return
    apart = rate - (output - float(np.median(output - rate)))
    is_off = np.abs(apart) > OFF_SHARE * np.maximum(np.abs(rate), MIN_SHARE * fast)
    agreeing = int((~is_off).sum())
    if not is_off.any() or agreeing < MIN_AGREEING or agreeing < AGREEING_SHARE * len(is_off):
        return
    for row in np.flatnonzero(is_off):
        stated_dps, shown_dps = float(rate[row]), float(rate[row] - apart[row])
        yield Finding(
            "one_data_set", "likely", f"data set {int(numbers[row])}, axis {along.axis}",
            f"the rate is given as {along.sign * stated_dps:.6g} deg/s, but the output shows "
            f"{along.sign * shown_dps:.4g} "
            f"deg/s, where {agreeing} other data sets agree with their rate",
            along.sign * shown_dps, "deg/s", f"{along.sign * stated_dps:.6g} deg/s",
            "correct the rate, its sign or the number of the data set, or leave the data set out",
        )  # fmt: skip


def _wrapped(along: Position, numbers: Array, rate: Array, output: Array, bias_dps: float) -> Finding | None:
    """Return that an output wraps round, if the (m,) data sets that are off all jump by one range; else None.

    `bias_dps` is that of the slow data sets: of the fast ones most may be wrapped.
    """
    apart = rate - (output - bias_dps)
    is_off = np.abs(apart) > OFF_SHARE * np.maximum(np.abs(rate), MIN_SHARE * float(np.abs(rate).max()))
    if is_off.sum() < 2 or (~is_off).sum() < MIN_AGREEING:
        return None
    jump = float(np.median(np.abs(apart[is_off])))
    top = float(np.abs(output).max())
    one_jump = bool(np.all(np.abs(np.abs(apart[is_off]) / jump - 1) < SAME_JUMP))
    outward = bool(np.all(np.sign(apart[is_off]) == np.sign(rate[is_off])))
    if not (one_jump and outward and jump / 2 > (1 - SAME_JUMP) * top):
        return None
    return Finding(
        "wrapped", "certain", f"axis {along.axis}, {numbers_in_words(numbers[is_off])}",
        f"the output is {jump:.6g} deg/s from the rate, always towards the other end of its range, and never "
        f"beyond {top:.6g} deg/s: its number wraps round there",
        jump, "deg/s", "an output that follows the rate",
        "leave these data sets out, or give the words as unsigned or wider ones (signed_bits of the column map)",
    )  # fmt: skip
