"""Readings that do not belong together: two units of measure in one file, two devices, a channel that is a copy."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, pairwise

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.jumps import jump_of
from labctl.recording.sanity.readings.series import ROBUST, Array, Marked, Rows, Series, noise_of, rows_in_words

#: Blocks in which the noise of long data sets is compared, and readings of one.
BLOCKS, MIN_IN_BLOCK = 40, 50
#: The ratio of deg/s to rad/s, and how near to it, as a logarithm, a ratio of noises must be; that of
#: one output alone.
DEG_PER_RAD, NEAR, VERY_NEAR = 180.0 / np.pi, 0.4, 0.12
#: The same of a gain, in which the bias of the outputs is too.
GAIN_NEAR = 1.0
#: Another output that is at least this share of the table's rate: the table turns about its axis.
OTHER_AXIS = 0.5
#: Rates from this size on (root mean square), deg/s, show the gain of the outputs.
MIN_RATE_DPS = 1.0
#: Third differences of a copy have at least this squared correlation with those of its source; and how many must move.
COPY, MIN_MOVING = 0.97, 50
#: Two devices by turns: their readings differ by this many noises of readings of one.
BY_TURNS = 3.0
#: Two devices in any order: their levels are this many times the spread within one apart, and so many steps of a code;
#: each has this share of the readings, and this share of them lie between two of the other. Levels are taken over so
#: many readings, and at most this share of readings is in the middle between them.
INTERMIXED, INTERMIXED_CODES, MIN_SHARE, MIN_TURNS, LEVEL_READINGS, BETWEEN = 6.0, 3.0, 0.1, 0.1, 101, 0.01
#: Two devices one after the other: both levels last so many readings, and are this many noises apart in two outputs.
BESIDE, MIN_NEIGHBOURS, APART = 60, 10, 3.5
#: One output alone changes its level by this many noises, with this share of the readings of its data set on each side.
APART_ALONE, ALONE_SHARE = 6.0, 0.1
#: And by so many times what such differences usually are: an output that a filter has smoothed differs by more.
STEPS_USUAL = 6.0
#: Within a drift: the readings next to the step show it as the means do, and no step leads back by this share of it.
AT_ONCE, BACK_SHARE = (0.6, 1.7), 0.3
#: The level at the beginning and that at the end of a data set differ by at least this share of a step that lasts.
OUTER_SHARE = 0.25
#: Readings change by turns between two devices where the difference is as steady as this, over so many blocks; a line
#: at half the sampling rate swells and fades.
STEADY, STEADY_BLOCKS = 0.2, 8


def check_units(series: Series) -> Iterator[Marked]:
    """Yield the rows whose outputs are as much smaller than the others' as rad/s are than deg/s: of all, or of one."""
    names = list(series.outputs)
    faults = list(_units_of(series, names))
    if not faults and len(names) > 1:
        faults = [each for name in names for each in _units_of(series, [name])]
    yield from faults


def _units_of(series: Series, names: list[str]) -> Iterator[Marked]:
    blocks = _blocks(series)
    if len(blocks) < 4:
        return
    noises = np.array([[noise_of(series.outputs[name][block]) for name in names] for block in blocks])
    has_noise = (noises > 0).all(axis=1)
    if has_noise.sum() < 4:
        return
    size = np.full(len(blocks), np.nan)
    size[has_noise] = np.mean(np.log(noises[has_noise] / np.median(noises[has_noise], axis=0)), axis=1)
    split = _two_levels(size[has_noise])
    if split is None:
        return
    each = np.log(noises[has_noise])
    low = size[has_noise] < split
    apart = np.median(each[~low], axis=0) - np.median(each[low], axis=0)
    if np.any(np.abs(apart - np.log(DEG_PER_RAD)) > NEAR):
        return
    rows = np.zeros(len(series), dtype=bool)
    for block, value in zip(blocks, size, strict=True):
        rows[block] = value < split
    off = float(np.max(np.abs(apart - np.log(DEG_PER_RAD))))
    if not _gains_agree(series, names, rows, off=off):
        return
    ratio = float(np.exp(np.mean(apart)))
    outputs = "every output" if len(names) == len(series.outputs) else names[0]
    yield Marked(
        Finding(
            "mixed_units", "certain", ("" if outputs == "every output" else f"{names[0]}, ") + rows_in_words(rows),
            f"the noise of {outputs} is {ratio:.3g} times smaller than in the other rows, near 180/pi: these "
            "readings are in rad/s, the others in deg/s",
            ratio, "1", "one unit in a file",
            "convert the rows of one part in the file (180/pi = 57.2958), or import the two parts as recordings of "
            "their own",
            channel="" if outputs == "every output" else names[0], n=int(rows.sum()),
        ),
        rows,
    )  # fmt: skip


def _gains_agree(series: Series, names: list[str], rows: Rows, *, off: float) -> bool:
    """Whether the gain over the table's rate is as much smaller as the noise is: noise alone may change with the rate.

    At rest the noise of two outputs or more must do, or of one the noise and the level, or its noise alone if that is
    `off` the ratio, as a logarithm, by little.
    """
    if series.rate_dps is None or min(_rms(series.rate_dps[rows]), _rms(series.rate_dps[~rows])) < MIN_RATE_DPS:
        if any(_levels_differ(series.outputs[name], rows) for name in names):
            return False  # a filter lowers the noise, and leaves the level
        return len(names) > 1 or _levels_agree(series.outputs[names[0]], rows) or off < VERY_NEAR
    low, high = (_gain_along(series, names, part) for part in (rows, ~rows))
    return min(low, high) > 0 and abs(np.log(high / low / DEG_PER_RAD)) < GAIN_NEAR


def _gain_along(series: Series, names: list[str], rows: Rows) -> float:
    """Return the usual size of the outputs over the table's rate in data sets within some rows, of the largest each.

    Where the table turns about the axis of another output, one alone shows its misalignment, which may be any, and is
    quiet: what the table does to it is in the other one. Such data sets say nothing of its gain.
    """
    assert series.rate_dps is not None
    if series.motion == "profile":
        rate = series.rate_dps[rows]
        return max(abs(float(series.outputs[name][rows] @ rate)) for name in names) / float(rate @ rate)
    sizes = []
    for part in series.parts:
        speed = abs(float(np.median(series.rate_dps[part])))
        others = (values for name, values in series.outputs.items() if name not in names)
        if any(abs(float(np.median(values[part]))) > OTHER_AXIS * speed for values in others):
            continue
        if speed >= MIN_RATE_DPS and rows[part].mean() > 0.5:
            sizes.append(max(abs(float(np.median(series.outputs[name][part]))) for name in names) / speed)
    return float(np.median(sizes)) if sizes else 0.0


def _levels_agree(values: Array, rows: Rows) -> bool:
    low, high = (abs(float(np.median(values[part]))) for part in (rows, ~rows))
    return low > 0 and abs(np.log(max(high / low, 1e-12) / DEG_PER_RAD)) < NEAR


def _levels_differ(values: Array, rows: Rows) -> bool:
    """Whether the level changes by another factor than the unit where the readings in rad/s begin or end.

    A filter that is switched leaves it, and the noise falls.
    """
    for row in np.flatnonzero(rows[1:] != rows[:-1]) + 1:
        length = max(len(values) // BLOCKS, MIN_IN_BLOCK)  # the row is known to a block
        parts = [values[max(row - 3 * length, 0) : row - length], values[row + length : row + 3 * length]]
        if min(len(part) for part in parts) < MIN_IN_BLOCK // 2:
            continue
        low, high = parts if rows[row - 1] else parts[::-1]
        spreads = [float(np.percentile(np.abs(part - np.median(part)), 90)) for part in (low, high)]
        off = abs(float(np.median(low)) - float(np.median(high)) / DEG_PER_RAD)
        if off > 2.0 * (spreads[0] + spreads[1] / DEG_PER_RAD):
            return True
    return False


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0


def _blocks(series: Series) -> list[slice]:
    blocks = []
    for part in series.parts:
        length = part.stop - part.start
        size = max(length // BLOCKS, MIN_IN_BLOCK) if len(series.parts) < BLOCKS // 4 else length
        edges = np.linspace(part.start, part.stop, max(length // size, 1) + 1).astype(np.int64)
        blocks += [slice(int(a), int(b)) for a, b in pairwise(edges) if b - a >= MIN_IN_BLOCK]
    return blocks


def _two_levels(values: Array) -> float | None:
    """Return what divides values (m,) where the largest distance between neighbours is; None for one of less than 2."""
    ordered = np.sort(values)
    apart = np.diff(ordered)
    widest = int(np.argmax(apart))
    return float(ordered[widest] + apart[widest] / 2) if apart[widest] > 1.0 else None


def check_copies(series: Series) -> Iterator[Marked]:
    """Yield the outputs that are a copy of another, in their unit or scaled."""
    third = {name: np.diff(values, 3) for name, values in series.outputs.items()}
    for (one, a), (other, b) in combinations(third.items(), 2):
        scale = _scale_of_copy(a, b)
        if scale is None:
            continue
        yield Marked(
            Finding(
                "copied", "certain", f"{other} and {one}",
                f"{other} is {scale:.5g} times {one} down to its noise: one is a copy of the other",
                scale, "1", "outputs with noise of their own",
                "correct the column map: one of the two columns is not this axis; or leave the axis out",
                channel=other, n=len(series),
            ),
            np.ones(len(series), dtype=bool),
        )  # fmt: skip


def _scale_of_copy(a: Array, b: Array) -> float | None:
    """Return by which factor third differences b (n,) are those of a; None where they are no copy."""
    moving = (a != 0) | (b != 0)
    if moving.sum() < MIN_MOVING:
        return None
    limits = [8.0 * max(float(np.median(np.abs(each[moving]))), 1e-300) for each in (a, b)]
    usual = moving & (np.abs(a) < limits[0]) & (np.abs(b) < limits[1])  # a knock that all axes feel is no copy
    if usual.sum() < MIN_MOVING:
        return None
    product, power = float(a[usual] @ b[usual]), float(a[usual] @ a[usual])
    if power == 0 or product == 0 or product**2 < COPY * power * float(b[usual] @ b[usual]):
        return None
    return product / power


def check_devices(series: Series) -> Iterator[Marked]:
    """Yield rows of a second device: by turns with the first, or after it."""
    by_turns = [name for name, values in series.residuals.items() if _alternates(values)]
    if by_turns:
        name = by_turns[0]
        apart = float(np.abs(np.mean(_signed(series.residuals[name]))) * 2)
        yield Marked(
            Finding(
                "two_devices", "certain", f"{', '.join(by_turns)}, every second row",
                f"every second reading is {apart:.3g} deg/s from those between: two devices write into one file",
                apart, "deg/s", "one device in a recording", "divide the rows by device, and import each by itself",
                channel=name, n=len(series) // 2,
            ),
            np.arange(len(series)) % 2 == 1,
        )  # fmt: skip
        return
    mixed = {
        name: intermixed
        for name, values in series.residuals.items()
        if (intermixed := _intermixed(values, series.code_steps[name])) is not None
        and series.motion in ("rest", "rates")
    }
    if mixed:
        name, rows = max(mixed.items(), key=lambda each: float(np.median(np.abs(np.diff(series.residuals[each[0]])))))
        values = series.residuals[name]
        apart = abs(float(np.median(values[rows]) - np.median(values[~rows])))
        yield Marked(
            Finding(
                "two_devices", "certain", f"{', '.join(mixed)}, {rows_in_words(rows)}",
                f"readings change between two levels {apart:.3g} deg/s apart, in any order: two devices write into one "
                "file",
                apart, "deg/s", "one device in a recording", "divide the rows by device, and import each by itself",
                channel=name, n=int(rows.sum()),
            ),
            rows,
        )  # fmt: skip
        return
    yield from _after(series)


def _intermixed(values: Array, step: float) -> Rows | None:
    """Return the rows of the smaller of two groups of (n,) readings whose levels are apart; None for one group."""
    if len(values) < 2 * LEVEL_READINGS:
        return None
    padded = np.pad(values, LEVEL_READINGS // 2, mode="edge")
    total = np.concatenate([[0.0], np.cumsum(padded)])
    off = values - (total[LEVEL_READINGS:] - total[:-LEVEL_READINGS]) / LEVEL_READINGS
    high = off > 0
    if not MIN_SHARE < high.mean() < 1 - MIN_SHARE or np.mean(high[1:] != high[:-1]) < MIN_TURNS:
        return None
    levels = [float(np.median(off[rows])) for rows in (high, ~high)]
    spreads = [float(np.median(np.abs(off[rows] - level))) for rows, level in zip((high, ~high), levels, strict=True)]
    within = ROBUST * max(spreads)
    apart = levels[0] - levels[1]
    middle = np.mean(np.abs(off - np.mean(levels)) < apart / 6)
    if apart < INTERMIXED * within or apart < INTERMIXED_CODES * step or middle > BETWEEN:
        return None
    return high if high.mean() < 0.5 else ~high


def _signed(values: Array) -> Array:
    return values * np.where(np.arange(len(values)) % 2, 1.0, -1.0)


def _alternates(values: Array) -> bool:
    if len(values) < 100:
        return False
    swing = np.diff(values)
    sign = np.where(np.arange(len(swing)) % 2, -1.0, 1.0)
    mean = float(np.median(sign * swing))
    spread = float(np.median(np.abs(values[2:] - values[:-2]))) * ROBUST / np.sqrt(2)
    if abs(mean) <= BY_TURNS * max(spread, 1e-300):
        return False
    blocks = [float(np.median(block)) for block in np.array_split(sign * swing, STEADY_BLOCKS)]
    return float(np.ptp(blocks)) < 2 * STEADY * abs(mean)


def _after(series: Series) -> Iterator[Marked]:
    for part in series.parts:
        n = part.stop - part.start
        if n < 4 * MIN_NEIGHBOURS or not (series.still[part].all() or series.rate_dps is not None):
            continue  # turned by hand, a unit changes its rate on all axes at once
        steps_by_name = {
            name: _steps_of_level(values[part], series.noises[name]) for name, values in series.residuals.items()
        }
        row = int(np.argmax(np.sum([np.abs(step) for step in steps_by_name.values()], axis=0)))
        apart = {name: float(step[row]) for name, step in steps_by_name.items() if abs(step[row]) > APART}
        lasting = {
            name
            for name in apart
            if _lasts(series.residuals[name][part], row, series.noises[name], steps_by_name[name])
        }
        if len(lasting) < 2:
            share = min(row, n - row) / n
            lasting = lasting if series.motion == "rest" and share > ALONE_SHARE else set()  # else a rate changes
            alone = {name: row for name in lasting if abs(apart[name]) > APART_ALONE}
            if not alone and series.motion == "rest":
                alone = _jumps(series, part)
            yield from (_level_step(series, name, part.start + at, part) for name, at in alone.items())
            continue
        rows = np.zeros(len(series), dtype=bool)
        rows[part.start + row : part.stop] = True
        name = max(lasting, key=lambda each: abs(apart[each]))
        size = _size_at(series.residuals[name][part], row)
        yield Marked(
            Finding(
                "two_devices", "likely", f"{', '.join(sorted(lasting))}, from row {part.start + row + 1} on",
                f"the level of {len(lasting)} outputs changes at once, that of {name} by {size:.3g} deg/s: another "
                "device, or the same after it was switched off or mounted again",
                size, "deg/s", "one device in one mounting in a data set",
                f"divide the recording at row {part.start + row + 1}", channel=name, n=int(rows.sum()),
            ),
            rows,
        )  # fmt: skip


def _jumps(series: Series, part: slice) -> dict[str, int]:
    """Return the outputs whose level jumps within a drift, and the rows of a data set where they do."""
    jumps = {
        name: jump_of(values[part], series.noises[name], series.code_steps[name])
        for name, values in series.residuals.items()
    }
    ends = ALONE_SHARE * (part.stop - part.start)
    return {name: row for name, row in jumps.items() if row is not None and ends < row < part.stop - part.start - ends}


def _level_step(series: Series, name: str, row: int, part: slice) -> Marked:
    rows = np.zeros(len(series), dtype=bool)
    rows[row : part.stop] = True
    size = _size_at(series.residuals[name][part], row - part.start)
    return Marked(
        Finding(
            "level_step", "likely", f"{name}, from row {row + 1} on",
            f"the level of this output alone changes at once by {size:.3g} deg/s, and stays: a shock, a contact, or "
            "the unit was switched",
            size, "deg/s", "a level that drifts slowly", f"divide the recording at row {row + 1}",
            channel=name, n=int(rows.sum()),
        ),
        rows,
    )  # fmt: skip


def _steps_of_level(values: Array, noise: float) -> Array:
    """Return at each row of (n,) the mean after less that before, in noises; 0 near the ends."""
    n = len(values)
    if noise <= 0:
        return np.zeros(n)
    limit = 200.0 * noise
    total = np.concatenate([[0.0], np.cumsum(np.clip(values - np.median(values), -limit, limit))])
    at = np.arange(n)
    low, high = np.maximum(at - BESIDE, 0), np.minimum(at + BESIDE, n)
    before, after = np.maximum(at - low, 1), np.maximum(high - at, 1)
    step = (total[high] - total[at]) / after - (total[at] - total[low]) / before
    step[(at < MIN_NEIGHBOURS) | (at > n - MIN_NEIGHBOURS)] = 0.0
    usual = STEPS_USUAL / APART * ROBUST * float(np.median(np.abs(step[MIN_NEIGHBOURS : n - MIN_NEIGHBOURS])))
    return np.asarray(step / max(noise, usual))


def _size_at(values: Array, row: int) -> float:
    """Return by how much the level of (n,) readings next to a row changes."""
    before, after = values[max(row - 1 - MIN_NEIGHBOURS, 0) : row - 1], values[row + 1 : row + 1 + MIN_NEIGHBOURS]
    return float(np.median(after) - np.median(before))


def _lasts(values: Array, row: int, noise: float, steps: Array) -> bool:
    """Whether a level changes at a row at once and for good: not a creep, not a turn that ends.

    Of `steps` (n,), those of the level at each row, none leads back.
    """
    step = _size_at(values, row)
    if abs(step) <= 2.5 * noise:
        return False
    whole = float(np.median(values[row:]) - np.median(values[:row]))
    # within a motion that ends, half of the readings on either side are not yet, or no longer, of it
    outer = float(np.median(values[row + (len(values) - row) // 2 :]) - np.median(values[: max(row // 2, 1)]))
    if 0.5 < whole / step < 2.0 and outer / step > OUTER_SHARE:
        return True
    # with a drift of the same size the medians differ by something else
    at_once = AT_ONCE[0] < step / noise / steps[row] < AT_ONCE[1]
    return at_once and float((-np.sign(step) * steps).max()) < BACK_SHARE * abs(float(steps[row]))
