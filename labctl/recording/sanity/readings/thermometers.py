"""Thermometers: one that is not there, one that changes its unit, one that stood still and jumps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Array, Marked, Rows, Series, rows_in_words

#: What thermometers answer that are not there: DS18B20 not connected and after power-on, zeros, an open input.
NO_THERMOMETER_C = (-127.0, 85.0, 0.0, -273.15)
#: Below this no gyro is measured, deg C. Other words count where the reading jumps to them by this much, K, or by so
#: many times its usual step.
IMPOSSIBLE_C, JUMP_K, JUMP_STEPS = -100.0, 2.5, 20.0
#: Few gyros work above this, deg C; a thermometer of which so many readings are above it has another unit.
HOT_C, HOT_SHARE = 150.0, 0.02
#: A temperature jumps where it changes faster than this, K/s, over the time since it changed last; of that time at most
#: so many usual ones between two changes count. And a jump is so many usual changes.
JUMP_K_S, USUAL_HOLDS, USUAL_STEPS = 0.2, 2.0, 5.0
#: Readings on either side that show whether a jump lasts, and the share of it that must.
BESIDE, LASTING_SHARE = 9, 0.7
#: Within a soak the temperature changes by less than this share of the jump to the next one.
SOAK_SHARE = 0.2
#: Rates that differ by less than this share of their span are one level.
RATE_SHARE = 0.01
#: Of rates in steps, more than this share of the readings have the rate of the one before.
HELD_SHARE = 0.75
#: The reading after a jump is that before in the other unit where it is this near, K.
NEAR_K = 2.0


def check_thermometers(series: Series) -> Iterator[Marked]:
    """Yield the thermometers that answer the word of one that is not there, change their unit, or jump."""
    for name, values in series.thermometers.items():
        rows = values < IMPOSSIBLE_C
        for word in NO_THERMOMETER_C:
            at_word = np.abs(values - word) < 1e-6
            if at_word.any() and _jumps(series, values, at_word):
                rows = rows | at_word
        n = int(rows.sum())
        yield from _check_hot(name, values)
        yield from _check_jumps(series, name, values, ~rows)
        if not n:
            continue
        word = float(values[rows][0])
        yield Marked(
            Finding(
                "thermometer", "certain", f"{name}, {rows_in_words(rows)}",
                f"{n} readings are {word:g} deg C, which a thermometer answers that is not connected or not ready",
                word, "deg C", "the temperature of the unit",
                "leave these readings out, and check the thermometer's cable", channel=name, n=n,
                may_leave_out=n < len(values),
            ),
            rows,
        )  # fmt: skip


def _jumps(series: Series, values: Array, at_word: Rows) -> bool:
    """Whether a channel comes to a word, or leaves it, within a data set by more than a temperature can."""
    steps = np.abs(np.diff(values))
    crossing = (at_word[1:] != at_word[:-1]) & (series.dataset[1:] == series.dataset[:-1])
    if not crossing.any():
        return False
    usual = steps[~crossing & (steps > 0)]
    limit = max(JUMP_K, JUMP_STEPS * float(np.median(usual)) if len(usual) else 0.0)
    return bool(np.median(steps[crossing]) > limit)


def _check_hot(name: str, values: Array) -> Iterator[Marked]:
    rows = values > HOT_C
    if float(rows.mean()) > HOT_SHARE:  # single ones are spikes
        highest = float(values.max())
        yield Marked(
            Finding(
                "thermometer", "likely", f"{name}, {rows_in_words(rows)}",
                f"{int(rows.sum())} readings are above {HOT_C:g} deg C, up to {highest:.4g} deg C",
                highest, "deg C", f"at most {HOT_C:g} deg C",
                "check the unit of the column: deg F, tenths of a degree, or words of a converter?",
                channel=name, n=int(rows.sum()),
            ),
            rows,
        )  # fmt: skip


def _check_jumps(series: Series, name: str, values: Array, usable: Rows) -> Iterator[Marked]:
    """Yield where a temperature changes at once and stays: to its value in deg F, or by what a still one missed."""
    at = np.flatnonzero(usable)
    if len(at) < 4 * BESIDE:
        return
    jumps = lasting_jumps(series.t_s[at], values[at])
    if not jumps:
        return
    if (fahrenheit := _in_fahrenheit(values[at], jumps)) is not None:
        rows = np.zeros(len(values), dtype=bool)
        rows[at[fahrenheit]] = True
        n = int(rows.sum())
        first = float(values[rows][0])
        yield Marked(
            Finding(
                "thermometer", "certain", f"{name}, {rows_in_words(rows)}",
                f"{n} readings are in deg F: the temperature changes at once to what the same temperature is in it "
                f"({first:.4g} deg F are {(first - 32) / 1.8:.4g} deg C)",
                first, "deg C", "one unit throughout",
                "convert these readings by (T - 32) / 1.8, or leave them out", channel=name, n=n, may_leave_out=True,
            ),
            rows,
        )  # fmt: skip
        return
    row = int(at[max(jumps, key=lambda k: abs(values[at[k]] - values[at[k - 1]]))])
    before = values[at[np.searchsorted(at, row) - 1]]
    rows = np.zeros(len(values), dtype=bool)
    rows[at[jumps]] = True
    size = float(values[row] - before)
    cause, remedy = _SOAKS if _are_soaks(series, values, at[jumps]) else _THERMOMETER
    yield Marked(
        Finding(
            "thermometer", "likely", f"{name}, {rows_in_words(rows)}",
            f"the temperature changes by {size:.3g} K from one reading to the next at row {row + 1}, and stays there: "
            f"{cause.format(parts=len(jumps) + 1)}",
            size, "K", "a temperature that changes slowly", remedy, channel=name, n=len(jumps),
        ),
        rows,
    )  # fmt: skip


#: What a lasting jump of a temperature comes from, and what to do.
_THERMOMETER = (
    "the thermometer stood still before, or was exchanged or moved",
    "find which of the parts is right, and import only that",
)
_SOAKS = (
    "the same rates follow at each temperature, so {parts} soaks were joined without the time between them",
    "give each row its true time; if the thermometer was exchanged or moved, import only the part that is right",
)


def _are_soaks(series: Series, values: Array, starts: NDArray[np.intp]) -> bool:
    """Return whether temperatures stand still between jumps, whose later parts have `starts`, at the same few rates."""
    if series.rate_dps is None or not np.ptp(series.rate_dps):
        return False
    parts = np.split(np.arange(len(values)), starts)
    jump = float(np.min(np.abs(values[starts] - values[starts - 1])))
    steps = series.rate_dps / (RATE_SHARE * float(np.ptp(series.rate_dps)))
    held = np.abs(np.diff(steps, prepend=steps[0])) < 1.0
    levels = [set(np.round(steps[part]).tolist()) for part in parts]
    return (
        all(float(np.ptp(values[part])) < SOAK_SHARE * jump for part in parts)
        and float(held.mean()) > HELD_SHARE
        and len(levels[0]) > 1
        and all(len(levels[0] & each) > len(levels[0] | each) / 2 for each in levels[1:])
    )


def lasting_jumps(t_s: Array, values: Array) -> list[int]:
    """Return the first readings after a jump, of (n,) temperatures at (n,) times."""
    steps = np.diff(values)
    changes = np.flatnonzero(steps) + 1
    if not len(changes):
        return []
    size = np.abs(steps[changes - 1])
    held = t_s[changes] - t_s[np.concatenate([[0], changes[:-1]])]
    apart = t_s[changes] - t_s[changes - 1]
    held = np.maximum(np.minimum(held, USUAL_HOLDS * float(np.median(held))) if len(changes) > BESIDE else apart, apart)
    usual = float(np.median(size)) if len(changes) > BESIDE else 0.0
    far = (size > max(JUMP_K, USUAL_STEPS * usual)) & (size > JUMP_K_S * held)
    return [int(row) for row in changes[far] if _stays(values, int(row))]


def _stays(values: Array, row: int) -> bool:
    before, after = values[max(row - BESIDE, 0) : row], values[row : row + BESIDE]
    step = float(np.median(after) - np.median(before))
    return abs(step) > LASTING_SHARE * abs(float(values[row] - values[row - 1]))


def _in_fahrenheit(values: Array, jumps: list[int]) -> Rows | None:
    """Return which of (n,) readings are in deg F, if every jump is to that unit or from it; else None."""
    rows = np.zeros(len(values), dtype=bool)
    for row in jumps:
        before, after = (float(np.median(values[part])) for part in (slice(max(row - 5, 0), row), slice(row, row + 5)))
        if abs(after - (1.8 * before + 32)) < NEAR_K:
            rows[row:] = True
        elif abs(before - (1.8 * after + 32)) < NEAR_K:
            rows[:row] |= not rows[:row].any()
            rows[row:] = False
        else:
            return None
    return rows
