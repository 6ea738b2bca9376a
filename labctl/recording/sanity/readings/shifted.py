"""Rows whose columns are shifted: a field was lost, so that an output holds a temperature and the reverse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import ROBUST, Array, Marked, Series, rows_in_words
from labctl.recording.sanity.readings.thermometers import lasting_jumps

#: Readings on either side of the ends of a stretch that show the levels there, and those that are needed.
BESIDE, MIN_NEIGHBOURS = 30, 8
#: A level is that of another column within so many standard deviations of its readings and this share; of a
#: temperature, K.
DEVIATIONS, SHARE, NEAR_K = 4.0, 0.02, 1.0
#: Units that an output may have had in its file, per deg/s.
PER_DPS = (1.0, np.pi / 180.0)


def check_shifted(series: Series) -> Iterator[Marked]:
    """Yield the stretches in which an output holds what a thermometer reads beside them, and the thermometer another.

    Both change at the same rows by much; each is compared with the other columns as they are next to the stretch.
    """
    n = len(series)
    for name, values in series.thermometers.items():
        if not np.isfinite(values).all():
            continue
        jumps = lasting_jumps(series.t_s, values)
        if not jumps:
            continue
        # whole and shifted rows take turns, and each look shifted beside the other: whole are the more
        stretches = list(pairwise([0, *jumps, n]))
        turns = sorted((stretches[::2], stretches[1::2]), key=lambda part: sum(end - begin for begin, end in part))
        rows, text = np.zeros(n, dtype=bool), ""
        for begin, end in turns[0]:
            if exchanged := _exchanged(series, name, begin, end):
                rows[begin:end], text = True, exchanged
        if not text:
            continue
        yield Marked(
            Finding(
                "shifted", "certain", f"{name}, {rows_in_words(rows)}",
                f"the columns of {int(rows.sum())} rows are shifted: {text}",
                float(rows.sum()), "rows", "the same columns in every row",
                "leave these rows out, or write them again with the field that is missing",
                channel=name, n=int(rows.sum()), may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _exchanged(series: Series, thermometer: str, begin: int, end: int) -> str:
    """Return which columns of a stretch hold what others do beside it, in words; nothing if none."""
    n = len(series)
    edges = [
        (slice(begin, min(begin + BESIDE, end)), slice(max(begin - BESIDE, 0), begin)),
        (slice(max(end - BESIDE, begin), end), slice(end, min(end + BESIDE, n))),
    ]
    usable = [(inside, beside) for inside, beside in edges if _length(inside) and _length(beside) >= MIN_NEIGHBOURS]
    for factor in PER_DPS:
        columns = {name: values * factor for name, values in series.outputs.items()}
        columns[thermometer] = series.thermometers[thermometer]
        for inside, beside in usable:
            held = {name: _held(columns, name, thermometer, inside, beside) for name in columns}
            as_temperature = [name for name, other in held.items() if other == thermometer]
            if as_temperature and held[thermometer]:
                return (
                    f"{as_temperature[0]} holds the temperature, and {thermometer} holds {held[thermometer]}, as both "
                    "are in the rows beside"
                )
    return ""


def _length(part: slice) -> int:
    return int(part.stop - part.start)


def _held(columns: Mapping[str, Array], name: str, thermometer: str, inside: slice, neighbours: slice) -> str:
    """Return the other column whose level beside a stretch a column has inside; nothing if it keeps its own."""
    level = float(np.median(columns[name][inside]))
    if _is_near(level, columns[name][neighbours], name == thermometer):
        return ""
    others = [other for other in columns if other != name]
    near = [other for other in others if _is_near(level, columns[other][neighbours], other == thermometer)]
    return near[0] if near else ""


def _is_near(level: float, values: Array, of_temperature: bool) -> bool:
    middle = float(np.median(values))
    spread = ROBUST * float(np.median(np.abs(values - middle)))
    allowed = DEVIATIONS * spread + (NEAR_K if of_temperature else SHARE * abs(middle))
    return abs(level - middle) <= allowed
