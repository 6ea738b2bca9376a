"""Readings at a limit: an output that does not go beyond a value, or whose steps are larger than its noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Array, Marked, Rows, Series, rows_in_words, spread_of

#: An output is coarse whose step is above so many times the noise that its readings have, steps included.
COARSE_STEP = 1.9
#: Readings at the end of a range, at least: of an output in fine steps, of any other.
LEAST_IN_STEPS, LEAST_EQUAL = 30, 8
#: An output is clipped where so many readings are expected beyond its last code, or the last code has this many times
#: the readings of the code before. Steps above this many noises leave no shape that could tell.
BEYOND, PILE, COARSE = 20.0, 2.5, 1.2


def check_steps(series: Series) -> Iterator[Marked]:
    """Yield the outputs whose steps are larger than their noise."""
    for name, values in series.outputs.items():
        step, spread = series.code_steps[name], spread_of(values)
        if not step or step < COARSE_STEP * spread:
            continue
        yield Marked(
            Finding(
                "quantised", "likely", name,
                f"the output changes in steps of {step:.4g} deg/s, and its readings differ by {spread:.2g} deg/s from "
                "one to the next",
                step, "deg/s", "a step below twice the noise", "log the output with more digits or a finer converter",
                channel=name, n=len(series),
            ),
            np.ones(len(series), dtype=bool),
        )  # fmt: skip


def check_clipped(series: Series, repeated: Rows) -> Iterator[Marked]:
    """Yield the outputs that pile up at an end of their range."""
    for name, values in series.outputs.items():
        step, noise = series.code_steps[name], series.noises[name]
        ends = []
        for sign in (1.0, -1.0):
            turned = sign * values
            top = float(turned.max())
            at_end = turned >= top - 0.25 * step if step else turned == top
            if _is_pile(turned[~repeated], at_end[~repeated], top, step, noise):
                ends.append((sign * top, at_end))
        if not ends:
            continue
        rows = np.any([at_end for _, at_end in ends], axis=0)
        shown = " and ".join(f"{top:.5g}" for top, _ in ends)
        yield Marked(
            Finding(
                "clipped", "likely", f"{name}, {rows_in_words(rows)}",
                f"{int(rows.sum())} readings are exactly at {shown} deg/s, and none beyond",
                ends[0][0], "deg/s", "readings that thin out towards the ends of their range",
                "leave out the data sets or readings at the limit, or measure at lower rates or in a larger range: "
                "means of clipped readings are too small",
                channel=name, n=int(rows.sum()), may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _is_pile(values: Array, at_end: Rows, top: float, step: float, noise: float) -> bool:
    n_end = int(at_end.sum())
    if n_end == len(values) or (noise == 0 and step):
        return False
    if not step:
        return n_end >= LEAST_EQUAL
    if n_end < LEAST_IN_STEPS or step > COARSE * noise:
        return False
    width = step * max(round(0.5 * noise / step), 1)  # codes that are much finer than the noise hold too few readings
    below = top - 0.5 * step - width * np.arange(3)
    before = int(np.sum((values < below[0]) & (values >= below[1])))
    second = int(np.sum((values < below[1]) & (values >= below[2])))
    ratio = n_end / max(before, 1)
    return ratio > PILE or n_end * ratio * min(ratio / max(before / max(second, 1), 1e-9), 1.0) > BEYOND
