"""What changes at once within a data set and stays: the noise of an output, the time between readings."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Array, Marked, Rows, Series, noise_of, rows_in_words, runs

#: Readings of a block in which the noise is found, least blocks of a data set, and the share of its largest third
#: differences that do not count: single readings far off are another fault.
BLOCK, MIN_BLOCKS, OFF_SHARE = 40, 5, 0.1
#: The noise changes where so many blocks in a row have so many times more or less than usual, and those beside not.
LASTING, TIMES = 2, 3.0
#: A whole data set is noisy that has so many times the noise of those at the same speed, of so many sets in all.
SET_TIMES, MIN_SETS = 6.0, 5
#: An output whose step is above so many noises has no noise that could be compared.
COARSE = 1.5
#: The time between readings changes where so many blocks in a row have so many times more or less.
STEP_BLOCK, STEP_LASTING, STEP_TIMES = 25, 3, 1.4
#: A change by this ratio, within this share, is one of the unit of time.
UNIT_RATIOS, NEAR_RATIO = {1e3: "ms", 1e6: "us", 1e9: "ns"}, 0.1


def check_noise(series: Series) -> Iterator[Marked]:
    """Yield the outputs whose noise changes at once within a data set: another filter or range, a loose contact."""
    if series.motion not in ("rest", "rates"):
        return  # by hand, and where the rate changes, a motion looks as noise does
    for name, values in series.outputs.items():
        if series.code_steps[name] > COARSE * series.noises[name]:
            continue
        rows, ratio = np.zeros(len(values), dtype=bool), 1.0
        for part in series.parts:
            rows[part], times = _other_noise(values[part])
            ratio = max(ratio, times, key=lambda each: abs(np.log(each)))
        for part, times in _noisy_sets(series, values):
            rows[part] = True
            ratio = max(ratio, times, key=lambda each: abs(np.log(each)))
        if not rows.any():
            continue
        yield Marked(
            Finding(
                "noise_changes", "likely", f"{name}, {rows_in_words(rows)}",
                f"the noise of {int(rows.sum())} readings is {ratio:.3g} times that of the others in their data set",
                float(ratio), "1", "the same noise throughout",
                "check contacts, filter and range of the unit; leave these readings out, or divide the recording there",
                channel=name, n=int(rows.sum()), may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _noisy_sets(series: Series, values: Array) -> list[tuple[slice, float]]:
    """Return the data sets whose noise is far above those at the same speed, and above the others, with the ratio.

    The motor of a table shakes a unit at some speeds, but in each data set at them.
    """
    if series.rate_dps is None or len(series.parts) < MIN_SETS:
        return []
    noises = np.array([noise_of(values[part]) for part in series.parts])
    speed = np.abs([series.rate_dps[part.start] for part in series.parts])
    usual = float(np.median(noises))
    noisy = []
    for k, part in enumerate(series.parts):
        like = noises[(speed == speed[k]) & (np.arange(len(noises)) != k)]
        if not len(like) or min(float(np.min(like)), usual) <= 0:
            continue
        times = float(noises[k] / max(float(np.max(like)), usual))  # along the table's axis an output has more noise
        if times > SET_TIMES:
            noisy.append((part, times))
    return noisy


def _other_noise(values: Array) -> tuple[Rows, float]:
    """Return which of (n,) readings of a data set have another noise, and how many times the usual they have."""
    rows = np.zeros(len(values), dtype=bool)
    blocks = len(values) // BLOCK
    if blocks < MIN_BLOCKS:
        return rows, 1.0
    third = np.abs(np.diff(np.append(values, np.repeat(values[-1], 3)), 3))[: blocks * BLOCK].reshape(blocks, BLOCK)
    least = np.sort(third[:, :-3], axis=1)[:, : int((1 - OFF_SHARE) * BLOCK)]
    size = np.sqrt(np.mean(least**2, axis=1))
    if not (size > 0).all():
        return rows, 1.0
    log = np.log(size)
    levels = _other_level(log, np.log(TIMES), LASTING)
    for begin, end in levels:
        rows[begin * BLOCK : len(values) if end == blocks else end * BLOCK] = True
    if not levels:
        return rows, 1.0
    of_blocks = np.zeros(blocks, dtype=bool)
    for begin, end in levels:
        of_blocks[begin:end] = True
    return rows, float(np.exp(np.median(log[of_blocks]) - np.median(log[~of_blocks])))


def _other_level(values: Array, least: float, lasting: int) -> list[tuple[int, int]]:
    """Return runs of (m,) values that leave the usual one by `least` at once, as (first, after the last)."""
    usual = float(np.sort(values)[(len(values) - 1) // 2])  # one of the two levels, not between them
    stretches = []
    for side in (1.0, -1.0):
        for begin, end in runs(side * (values - usual) > least):
            if end - begin < lasting or end - begin > len(values) - lasting:
                continue
            level = float(np.median(values[begin:end]))
            beside = [values[max(begin - 3, 0) : max(begin - 1, 1)]] if begin > 0 else []
            beside += [values[min(end + 1, len(values) - 1) : end + 3]] if end < len(values) else []
            if all(abs(level - float(np.median(each))) > least for each in beside):  # it does not creep there
                stretches.append((begin, end))
    return stretches


def check_sampling(series: Series) -> Iterator[Marked]:
    """Yield where the time between readings, or its unit, changes within a data set, or within a log at rest."""
    whole = [slice(0, len(series))]  # a log at rest is divided where its clock makes it look so
    for part in whole if series.motion == "rest" else series.parts:
        steps = np.diff(series.t_s[part])
        blocks = len(steps) // STEP_BLOCK
        if blocks < 2 * STEP_LASTING:
            continue
        usual = np.median(steps[: blocks * STEP_BLOCK].reshape(blocks, STEP_BLOCK), axis=1)
        if not (usual > 0).all():
            continue
        stretches = _other_level(np.log(usual), np.log(STEP_TIMES), STEP_LASTING)
        if not stretches:
            continue
        rows = np.zeros(len(series), dtype=bool)
        for begin, end in stretches:
            last = part.stop if end == blocks else part.start + end * STEP_BLOCK
            rows[part.start + begin * STEP_BLOCK : last] = True
        inside = rows[part][1:]
        other, common = float(np.median(steps[inside])), float(np.median(steps[~inside]))
        yield Marked(_sampling(rows, other, common), rows)
        return


def _sampling(rows: Rows, other: float, common: float) -> Finding:
    ratio = max(other / common, common / other)
    unit = next((name for per_s, name in UNIT_RATIOS.items() if abs(ratio / per_s - 1) < NEAR_RATIO), None)
    n = int(rows.sum())
    if unit is not None:
        which = "these rows" if other > common else "the other rows"
        return Finding(
            "time_unit", "certain", f"t_s, {rows_in_words(rows)}",
            f"time stamps follow every {other:.4g}, those of the other rows every {common:.4g}: the stamps of {which} "
            f"are in {unit}",
            ratio, "per s", "seconds throughout", f"divide t_s of {which} by {ratio:.0e}, and join the two clocks",
            channel="t_s", n=n,
        )  # fmt: skip
    return Finding(
        "sampling_rate", "likely", f"t_s, {rows_in_words(rows)}",
        f"{n} readings follow every {other:.4g} s, the others every {common:.4g} s: the sampling rate changes",
        1.0 / other, "Hz", f"{1.0 / common:.4g} readings a second throughout",
        "divide the recording there: noise, filter and weight of a reading differ", channel="t_s", n=n,
    )  # fmt: skip
