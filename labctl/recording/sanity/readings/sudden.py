"""Single readings far from those beside them, and stretches in which a unit that is said to rest moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import (
    ROBUST,
    Array,
    Marked,
    Rows,
    Series,
    medians_around,
    medians_of_five,
    rows_in_words,
    runs,
)

#: A reading is compared with the median of the five around it, and its distance with the usual one of so many readings.
USUAL_OVER = 100
#: Readings that a data set needs for that.
MIN_READINGS = 20
#: A spike is so many usual distances off, and so many steps of its code; of a temperature so many K.
SPIKE_NOISES, SPIKE_CODES, SPIKE_K = 8.0, 3.0, 3.0
#: A spike is this many times as far off as 95 % of the readings beside it.
JERKS = 4.0
#: And this many times as far off as the readings two to four places away.
ALONE = 2.5
#: More readings than this share of all are no spikes.
MAX_SPIKE_SHARE = 0.02
#: A rest is examined in blocks of this long, s, and at least so many readings, against the median of so many blocks.
BLOCK_S, BLOCK_READINGS, LEVEL_BLOCKS = 0.5, 8, 601
#: The median of such a block is near the level where the unit swings to and fro within it: then shorter blocks, s.
SWING_BLOCK_S = 0.1
#: A unit moves where a block's median is off by so many usual distances, and by this much, deg/s, in a record at rest.
MOVED_NOISES, MOVED_DPS = 12.0, 0.02
#: The same of a data set at rest on a table, whose output has the turns before it to follow.
MOVED_ON_TABLE_DPS = 0.3
#: And by so many times what the level wanders by itself; of a motion as large as that on a table fewer are enough.
WANDER, WANDER_LARGE = 8.0, 3.0
#: Standard deviation of a median in that of a mean.
MEDIAN_NOISE = 1.25
#: A unit that is turned is at its rate, or back, within so many s and so many blocks; heat takes longer.
SUDDEN_S, SUDDEN_BLOCKS = 20.0, 4


def check_spikes(series: Series) -> Iterator[Marked]:
    """Yield single readings of the outputs and thermometers that are far from those beside them."""
    for name, values in {**series.residuals, **series.thermometers}.items():
        is_output = name in series.outputs
        least = SPIKE_CODES * series.code_steps[name] if is_output else SPIKE_K
        size = np.zeros(len(values))
        rows = np.zeros(len(values), dtype=bool)
        for part in series.parts:
            if is_output and series.rate_dps is None and not series.still[part].all():
                continue  # turned by hand, an output may change in one reading
            noise = series.noises[name] if is_output else 0.0
            size[part], rows[part] = _spikes(values[part], least, noise, steady=series.motion in ("rest", "rates"))
        n = int(rows.sum())
        if not n or n > max(MAX_SPIKE_SHARE * len(values), 1):
            continue
        worst = int(np.argmax(np.where(rows, np.abs(size), 0.0)))
        unit = "deg/s" if is_output else "deg C"
        yield Marked(
            Finding(
                "spikes", "likely", f"{name}, {rows_in_words(rows)}",
                f"{n} single readings are far from those beside them, row {worst + 1} by {size[worst]:.3g} {unit}",
                float(size[worst]), unit, "neighbours that differ by their noise", "leave these readings out",
                channel=name, n=n, may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _spikes(values: Array, least: float, noise: float, *, steady: bool) -> tuple[Array, Rows]:
    """Return how far each reading of a data set, (n,), is from those around, and which of them are spikes."""
    if len(values) < MIN_READINGS:
        return np.zeros(len(values)), np.zeros(len(values), dtype=bool)
    off = values - medians_of_five(values)
    size = np.abs(off)
    usual = max(ROBUST * float(np.median(size)), noise)
    far = (size > SPIKE_NOISES * max(usual, 1e-300)) & (size > least)
    far[:2] = far[-2:] = False  # has readings on one side only
    if not far.any():
        return off, far
    far &= size > ALONE * _largest_beside(size)  # where a table starts, the unit swings
    if steady:  # the steps of a table's motor shake the unit at some rates
        far &= size > JERKS * _largest_of_blocks(size)
    else:  # at a turn of a motion the median is off, but not a cubic; by hand the usual distance changes too
        beside = np.pad(values, 2, mode="edge")
        cubic = np.abs(values - (4.0 * (beside[1:-3] + beside[3:-1]) - beside[:-4] - beside[4:]) / 6.0)
        far &= cubic > np.maximum(SPIKE_NOISES * usual, JERKS * _largest_of_blocks(cubic))
    return off, far


def _largest_beside(values: Array) -> Array:
    """Return for each of (n,) values the largest of those two to four places away."""
    padded = np.pad(values, 4)
    n = len(values)
    return np.asarray(np.max([padded[4 + by : 4 + by + n] for by in (-4, -3, -2, 2, 3, 4)], axis=0))


def _largest_of_blocks(values: Array) -> Array:
    """Return for each of (n,) values the largest 95 % quantile of its block and of those beside it."""
    over = min(USUAL_OVER, len(values))
    blocks = len(values) // over
    most = np.quantile(values[: blocks * over].reshape(blocks, over), 0.95, axis=1)
    beside = np.pad(most, 1, mode="edge")
    largest = np.max([beside[:-2], most, beside[2:]], axis=0)
    return largest[np.minimum(np.arange(len(values)) // over, blocks - 1)]


def check_moved(series: Series) -> Iterator[Marked]:
    """Yield the outputs that leave their level while the unit is said to rest."""
    if not series.still.any():
        return
    blocks = [max(round(each_s / series.step_s), BLOCK_READINGS) for each_s in (BLOCK_S, SWING_BLOCK_S)]
    for name, values in series.outputs.items():
        rows = np.zeros(len(values), dtype=bool)
        size = np.zeros(len(values))
        least = max(MOVED_DPS if series.motion == "rest" else MOVED_ON_TABLE_DPS, 2.5 * series.code_steps[name])
        for part in series.parts:
            for block in blocks if series.still[part].all() else ():
                if not rows[part].any():
                    rows[part], size[part] = _moves(values[part], block, least, series.step_s, series.noises[name])
        n = int(rows.sum())
        if not n:
            continue
        worst = int(np.argmax(np.abs(size)))
        yield Marked(
            Finding(
                "moved", "likely", f"{name}, {rows_in_words(rows)}",
                f"the unit is said to rest, but the output leaves its level by up to {size[worst]:.3g} deg/s for "
                f"{n * series.step_s:.3g} s in all",
                float(size[worst]), "deg/s", f"at most {least:.2g} deg/s",
                "leave these readings out, or give the rate that the unit was turned at",
                channel=name, n=n, may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _moves(values: Array, block: int, least: float, step_s: float, noise: float) -> tuple[Rows, Array]:
    blocks = len(values) // block
    rows, size = np.zeros(len(values), dtype=bool), np.zeros(len(values))
    if blocks < 8:
        return rows, size
    used = blocks * block
    medians = np.median(values[:used].reshape(blocks, block), axis=1)
    level = medians_around(medians, min(LEVEL_BLOCKS, 2 * blocks + 1)) if blocks > LEVEL_BLOCKS else np.median(medians)
    off = medians - level
    usual = ROBUST * float(np.median(np.abs(np.diff(medians)))) / np.sqrt(2)
    usual = max(usual, MEDIAN_NOISE * noise / np.sqrt(block))  # medians of few codes are often equal
    drift = ROBUST * float(np.median(np.abs(off)))
    quiet = max(least, MOVED_NOISES * usual)
    far = np.abs(off) > min(max(quiet, WANDER * drift), max(quiet, MOVED_ON_TABLE_DPS, WANDER_LARGE * drift))
    # a creeping output, such as one that warms up, leaves its level too, but not at once
    near = max(round(SUDDEN_S / (block * step_s)), SUDDEN_BLOCKS)
    for begin, end in runs(far):
        most = off[begin:end][int(np.argmax(np.abs(off[begin:end])))]
        side = float(np.sign(most))
        before = off[max(begin - 2, 0)] if begin else 0.0
        after = off[min(end + 1, blocks - 1)] if end < blocks else 0.0
        risen = float((side * (off[begin : min(begin + near, end)] - before)).max())
        fallen = float((side * (off[max(end - near, begin) : end] - after)).max())
        if min(risen, fallen) > max(least, 0.5 * abs(most)):
            rows[begin * block : end * block] = True
            size[begin * block : end * block] = most
    return rows, size
