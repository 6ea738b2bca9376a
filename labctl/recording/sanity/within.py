"""Within data sets: a unit that moves at rest, a rate that changes, an output in coarse steps, lost readings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labctl.recording.quantisation import quantisation_std
from labctl.recording.sanity.finding import Finding, numbers_in_words
from labctl.recording.sanity.summary import Summary
from labctl.recording.sanity.turned import is_turned

#: A unit moves at rest when its output wanders by this much, deg/s, by this share of its fastest rate, and by so many
#: times what the other data sets at rest do.
MOVES_DPS, MOVES_SHARE, MOVES_TIMES = 0.3, 2e-3, 10.0
#: From this share of the fastest rate on it certainly moved.
MOVED_SHARE = 0.02
#: A change of level counts from this many deg/s plus this share of the rate on; it is certain from the second pair on.
CHANGE_DPS, CHANGE_SHARE = 0.2, 0.01
CHANGED_DPS, CHANGED_SHARE = 1.0, 0.05
#: For means alone: a spread this many times that of the data sets at a like rate.
SPREAD_TIMES, MIN_PEERS = 10.0, 3
#: Quantisation shows in the means when its standard deviation is above this share of the step.
SHOWN_SHARE = 0.05


def check_at_rest(summary: Summary) -> Iterator[Finding]:
    """Yield the data sets at rest in which the unit moved."""
    still = np.asarray(summary["table_rate_dps"], dtype=np.float64) == 0
    if not still.any():
        return
    fast = float(np.abs(np.asarray(summary["table_rate_dps"], dtype=np.float64)).max())
    resting = "turn_deg is given as 0" if summary.info.motion == "turns" else "the table rate is given as 0"
    for axis in summary.info.axes:
        wander = summary.of_axis("wander", axis)
        if np.isnan(wander).all():
            continue
        usual = float(np.nanmedian(wander[still])) if still.sum() >= MIN_PEERS else 0.0
        moving = still & (wander > max(MOVES_DPS, MOVES_SHARE * fast, MOVES_TIMES * usual))
        if moving.any():
            most = float(wander[moving].max())
            yield Finding(
                "moves_at_rest", "certain" if most > max(MOVED_SHARE * fast, 1.0) else "likely",
                f"axis {axis}, {numbers_in_words(summary['dataset'][moving])}",
                f"{resting}, but the output changes by {most:.3g} deg/s (root mean square)",
                most, "deg/s", f"at most {max(MOVES_DPS, MOVES_SHARE * fast):.2g} deg/s",
                "correct the rate, or leave out the readings in which the unit was moved",
            )  # fmt: skip


def with_two_rates(summary: Summary, axis: str) -> NDArray[np.bool_]:
    """Return which data sets, (m,), have a sudden change of an output within them; a turn may have any."""
    rate, change = np.asarray(summary["table_rate_dps"], dtype=np.float64), summary.of_axis("change", axis)
    step = np.nan_to_num(summary.of_axis("code_step", axis))
    two_rates = np.abs(change) > np.maximum(CHANGE_DPS + CHANGE_SHARE * np.abs(rate), 3.0 * step)
    return np.asarray(two_rates & ~is_turned(summary))


def check_changes(summary: Summary) -> Iterator[Finding]:
    """Yield the data sets within which the output changes from one rate to another."""
    rate = np.asarray(summary["table_rate_dps"], dtype=np.float64)
    for axis in summary.info.axes:
        change, row = summary.of_axis("change", axis), summary.of_axis("change_row", axis)
        size, two_rates = np.abs(change), with_two_rates(summary, axis)
        if not two_rates.any():
            continue
        worst = int(np.argmax(np.where(two_rates, size, 0.0)))
        sure = size[worst] > CHANGED_DPS + CHANGED_SHARE * abs(rate[worst])
        yield Finding(
            "rate_changes", "certain" if sure else "likely",
            f"axis {axis}, {numbers_in_words(summary['dataset'][two_rates])}",
            f"the output changes by {change[worst]:.4g} deg/s at reading {int(row[worst]) + 1} of data set "
            f"{summary['dataset'][worst]}, whose rate is given as {rate[worst]:.6g} deg/s",
            float(change[worst]), "deg/s", "one rate per data set",
            "put the readings at each rate into a separate data set",
        )  # fmt: skip


def check_spread(summary: Summary) -> Iterator[Finding]:
    """Yield data-set means whose readings spread far more than those at a like rate: moved, or two rates in one."""
    if summary.info.kind != "points":
        return
    summary = summary.take(~is_turned(summary))
    rate = np.abs(np.asarray(summary["table_rate_dps"], dtype=np.float64))
    if not len(rate):
        return
    fast = float(rate.max(initial=0.0))
    for axis in summary.info.axes:
        spread = summary.of_axis("std", axis)
        if not np.isfinite(spread).all() or not np.any(spread > 0):
            continue
        usual = _usual_of_peers(rate, spread)
        far = (spread > SPREAD_TIMES * usual) & (spread > max(CHANGE_DPS, CHANGE_SHARE * fast))
        if far.any():
            worst = int(np.argmax(np.where(far, spread, 0.0)))
            yield Finding(
                "spread", "likely", f"axis {axis}, {numbers_in_words(summary['dataset'][far])}",
                f"the readings spread by {spread[worst]:.3g} deg/s, those of data sets at similar rates by "
                f"{usual[worst]:.2g} deg/s",
                float(spread[worst]), "deg/s", f"about {usual[worst]:.2g} deg/s",
                "the unit was moved, or the rate changed: leave these data sets out or measure them again",
            )  # fmt: skip


def _usual_of_peers(rate: NDArray[np.float64], spread: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median spread of the data sets nearest in rate, (m,)."""
    order = np.argsort(rate, kind="stable")
    usual = np.full(len(rate), float(np.median(spread)))
    for part in np.array_split(order, max(len(order) // 12, 1)):
        usual[part] = np.maximum(usual[part], np.median(spread[part]))
    return usual


def check_codes(summary: Summary) -> Iterator[Finding]:
    """Yield the axes whose readings come in steps that their means do not average out."""
    for axis in summary.info.axes:
        step, u = steps_of(summary, axis)
        if step is None:
            continue
        is_shown = u > SHOWN_SHARE * step
        if not is_shown.any():
            continue
        noise = float(np.median(summary.of_axis("std", axis)[is_shown]))
        yield Finding(
            "quantised", "likely", f"axis {axis}, {numbers_in_words(summary['dataset'][is_shown])}",
            f"the output changes in steps of {step:.4g} deg/s, the readings of these data sets spread by {noise:.2g} "
            f"deg/s, and their mean has an uncertainty of u = {float(u.max()):.2g} deg/s",
            step, "deg/s", "a step below twice the noise", "log the output with more digits or a finer converter",
            channel=f"gyro_{axis}",
        )  # fmt: skip


def steps_of(summary: Summary, axis: str) -> tuple[float | None, NDArray[np.float64]]:
    """Return the step between an output's codes, deg/s, and what it leaves in each mean, (m,) deg/s."""
    names = ("code_step", "code", "std", "white_std")
    return quantisation_std(*(summary.of_axis(name, axis) for name in names))
