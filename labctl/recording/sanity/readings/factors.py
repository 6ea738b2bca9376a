"""An output that is multiplied from a row on: another unit of measure, another range with the old scale, or a sign."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import (
    GUARD,
    MAX_NEIGHBOURS,
    MIN_NEIGHBOURS,
    Array,
    Marked,
    Series,
    spread_of,
)

DEG_PER_RAD = 180.0 / np.pi
#: Factors of a range that was switched while the old scale was kept; a gain of any other size is no switch.
RANGES = (2.0, 4.0, 8.0, 16.0)
#: Limits in standard uncertainties: agreement of level and noise with a factor, and significance of their changes.
AGREES, LEVEL_CHANGES, NOISE_CHANGES = 3.5, 6.0, 3.0
#: Standard uncertainty of the logarithm of a noise of n readings, by third differences, times sqrt(n): they are
#: correlated, the sum of the squares of their correlations is 2.31.
U_LOG_NOISE = 1.1
#: Largest resolution of an output, as a multiple of its noise; above it, level and noise are not known.
COARSE = 1.5
#: Relative standard uncertainty of a level, beside that of its readings and its drift.
LEVEL_SHARE = 1e-3
#: A sign changes at once: so many readings next to the row differ as the levels do, within this share. Smaller levels
#: than so many noises may change theirs by drift.
AT_ONCE, AT_ONCE_SHARE, LEVEL_NOISES = 3, 0.35, 3.0
#: Largest difference of the logarithms of the factor and of the ratio of the noise after a row to that before it.
MAX_LOG_DIFFERENCE = 0.4


@dataclass(frozen=True)
class Change:
    """By which factor an output changes from a row of its data set on."""

    row: int
    factor: float
    size: float  #: of the change of its level, in standard uncertainties


def check_factors(series: Series) -> Iterator[Marked]:
    """Yield the outputs whose level and noise are both multiplied by one known factor from a row on."""
    if series.motion not in ("rest", "rates"):
        return  # while the rate changes, the level beside a row is not known
    by_change: dict[str, tuple[int, Change]] = {}
    for name, values in series.outputs.items():
        if series.code_steps[name] > COARSE * series.noises[name]:
            continue
        changes = [
            (part.start, change)
            for part, rows in zip(series.parts, series.largest_changes[name], strict=True)
            if (change := _change(series, values[part], rows))
        ]
        if changes:
            by_change[name] = max(changes, key=lambda each: each[1].size)
    for name, (start, change) in by_change.items():
        yield _marked(series, name, start + change.row, change)


def _change(series: Series, values: Array, rows: Iterable[int]) -> Change | None:
    """Return the most significant change by a factor at one of some rows within the readings of a data set, (n,)."""
    factors = [DEG_PER_RAD, 1 / DEG_PER_RAD, *RANGES, *(1 / each for each in RANGES)]
    if series.motion == "rates":
        factors.append(-1.0)  # at rest the reversal of a unit changes the sign of the Earth's rate too
    changes = [change for row in rows for change in _by_factors(values, row, factors)]
    return max(changes, key=lambda each: each.size, default=None)


def _by_factors(values: Array, row: int, factors: Sequence[float]) -> Iterator[Change]:
    """Yield the change at a row by each factor that both level and noise agree with, if they changed at all."""
    edges = edges_of(values, row)
    if edges is None:
        return
    levels, u = edges[::2], edges[1::2]
    if abs(levels[1] - levels[0]) < LEVEL_CHANGES * math.hypot(*u):
        return
    before, after = beside(values, row)
    noises = [spread_of(each) for each in (before, after)]
    if min(noises) <= 0:
        return
    size = abs(levels[1] - levels[0]) / math.hypot(*u)
    u_noise = U_LOG_NOISE * float(np.hypot(1 / np.sqrt(len(before)), 1 / np.sqrt(len(after))))
    ratio = float(np.log(noises[1] / noises[0]))
    for factor in factors:
        expected = factor * levels[0]
        u_level = math.hypot(factor * u[0], u[1], LEVEL_SHARE * expected)
        if abs(ratio - math.log(abs(factor))) > AGREES * u_noise or abs(levels[1] - expected) > AGREES * u_level:
            continue
        if factor == -1.0:
            above_noise = min(abs(level) for level in levels) > LEVEL_NOISES * max(noises)
            agrees = above_noise and _is_at_once(values, row, levels[1] - levels[0])
        else:
            agrees = abs(ratio) >= NOISE_CHANGES * u_noise and _persists(values, row, factor)
        if agrees:
            yield Change(row, factor, size)


def _persists(values: Array, row: int, factor: float) -> bool:
    """Whether the noise of all readings after a row, of (n,), over that of all before it is a factor."""
    return bool(
        abs(np.log(spread_of(values[row + GUARD :]) / spread_of(values[: row - GUARD]) / factor)) < MAX_LOG_DIFFERENCE
    )


def beside(values: Array, row: int) -> tuple[Array, Array]:
    """Return the readings before and after a row of (n,), without those next to it."""
    return values[max(row - GUARD - MAX_NEIGHBOURS, 0) : max(row - GUARD, 0)], values[row + GUARD :][:MAX_NEIGHBOURS]


def edges_of(values: Array, row: int) -> tuple[float, float, float, float] | None:
    """Return the level of (n,) readings just before a row, its uncertainty, and those just after; None near the ends.

    An even drift on either side is followed to the row.
    """
    before, after = beside(values, row)
    if min(len(before), len(after)) < MIN_NEIGHBOURS:
        return None
    return *_at_edge(before, last=True), *_at_edge(after, last=False)


def _is_at_once(values: Array, row: int, change: float) -> bool:
    """Whether the readings next to a row, of (n,), change by as much as the levels do: no drift through 0."""
    before, after = values[max(row - 1 - AT_ONCE, 0) : row - 1], values[row + 1 : row + 1 + AT_ONCE]
    return bool(abs(float(after.mean() - before.mean()) / change - 1) < AT_ONCE_SHARE)


def _at_edge(values: Array, *, last: bool) -> tuple[float, float]:
    """Return the level of (n,) readings that drift evenly at their last or first row, and its uncertainty.

    An import asks this at some thousand rows: sums by `reduce` take a third of the time of `mean` and `sum`.
    """
    n = len(values)
    x, squares = _evenly(n)
    middle, slope = float(np.add.reduce(values)) / n, float(values @ x) / squares
    residual = values - middle - slope * x
    u = math.sqrt(float(np.add.reduce(residual * residual)) / max(n - 2, 1))
    return middle + slope * (0.5 if last else -0.5), 2.0 * u / math.sqrt(n)


@lru_cache(maxsize=MAX_NEIGHBOURS + 1)
def _evenly(n: int) -> tuple[Array, float]:
    """Return n places from -0.5 to 0.5, and the sum of their squares; the same of every stretch that long."""
    x = np.linspace(-0.5, 0.5, n)
    x.flags.writeable = False
    return x, float(x @ x)


def _marked(series: Series, name: str, row: int, change: Change) -> Marked:
    rows = np.zeros(len(series), dtype=bool)
    rows[row:] = True
    size = abs(change.factor)
    place_text = f"{name}, from row {row + 1} on"
    n = int(rows.sum())
    if change.factor < 0:
        return Marked(
            Finding(
                "sign", "certain", place_text,
                f"the output changes its sign at row {row + 1}: its level is {change.factor:g} times that before, with "
                "the same noise",
                change.factor, "1", "one sign in a recording", f"change the sign of {name} from row {row + 1} on, or "
                "divide the recording there",
                channel=name, n=n,
            ),
            rows,
        )  # fmt: skip
    if size in (DEG_PER_RAD, 1 / DEG_PER_RAD):
        unit, other = ("deg/s", "rad/s") if size > 1 else ("rad/s", "deg/s")
        return Marked(
            Finding(
                "mixed_units", "certain", place_text,
                f"level and noise of {name} are {size:.3g} times those of the rows before, 180/pi or its inverse: "
                f"from row {row + 1} on the output is in {unit}, before in {other}",
                size, "1", "one unit in a file",
                "convert the rows of one part in the file (180/pi = 57.2958), or import the two parts as recordings "
                "of their own",
                channel=name, n=n,
            ),
            rows,
        )  # fmt: skip
    return Marked(
        Finding(
            "gain_changes", "certain", place_text,
            f"level and noise of {name} are {size:.3g} times those of the rows before: the range was switched, and the "
            "scale of the output was not",
            size, "1", "one scale in a recording",
            f"multiply {name} by {1 / size:g} from row {row + 1} on, or divide the recording there",
            channel=name, n=n,
        ),
        rows,
    )  # fmt: skip
