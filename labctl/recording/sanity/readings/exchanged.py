"""Two outputs that change places from a row on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations
from statistics import NormalDist

import numpy as np

from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.factors import (
    COARSE,
    LEVEL_SHARE,
    NOISE_CHANGES,
    U_LOG_NOISE,
    beside,
    edges_of,
)
from labctl.recording.sanity.readings.series import Marked, Series, spread_of

#: The level of each is that of the other before within so many standard uncertainties, and not its own by so many.
AGREES, CHANGES = 4.0, 8.0


def check_exchanged(series: Series) -> Iterator[Marked]:
    """Yield the pairs of outputs of which each goes on at the level of the other."""
    if series.motion not in ("rest", "rates"):
        return
    fine = [name for name in series.outputs if series.code_steps[name] <= COARSE * series.noises[name]]
    tried = {pair: list(_places(series, pair)) for pair in combinations(fine, 2)}
    noise_changes = _noise_changes(sum(map(len, tried.values())))
    for (one, other), places in tried.items():
        exchanged = (
            part.start + row for part, row in places if _is_exchanged(series, (one, other), part, row, noise_changes)
        )
        first = next(exchanged, None)
        if first is None:
            continue
        rows = np.zeros(len(series), dtype=bool)
        rows[first:] = True
        yield Marked(
            Finding(
                "axes_swapped", "certain", f"{one} and {other}, from row {first + 1} on",
                f"the outputs change places at row {first + 1}: each goes on at the level of the other",
                float(first + 1), "row", "the same columns in every row",
                f"exchange {one} and {other} from row {first + 1} on, or divide the recording there",
                channel=other, n=int(rows.sum()),
            ),
            rows,
        )  # fmt: skip


def _places(series: Series, names: tuple[str, str]) -> Iterator[tuple[slice, int]]:
    """Yield the parts with the rows of each at which one of two outputs changes most."""
    for k, part in enumerate(series.parts):
        for row in sorted({row for name in names for row in series.largest_changes[name][k]}):
            yield part, row


def _noise_changes(places: int) -> float:
    """Return how many standard uncertainties a noise has to differ by, at any of so many places.

    By chance one in all of them does so as rarely as `NOISE_CHANGES` at a single place (Bonferroni).
    """
    by_chance = 2.0 * NormalDist().cdf(-NOISE_CHANGES) / max(places, 1)
    return -NormalDist().inv_cdf(by_chance / 2.0)


def _is_exchanged(
    series: Series, names: tuple[str, str], part: slice, row: int, noise_changes: float
) -> bool:  # fmt: skip
    one, other = (edges_of(series.outputs[name][part], row) for name in names)
    if one is None or other is None or min(*one[1::2], *other[1::2]) <= 0:
        return False
    (before_a, u_before_a, after_a, u_after_a), (before_b, u_before_b, after_b, u_after_b) = one, other
    off = max(
        abs(after_a - before_b) / math.hypot(u_after_a, u_before_b, LEVEL_SHARE * before_b),
        abs(after_b - before_a) / math.hypot(u_after_b, u_before_a, LEVEL_SHARE * before_a),
    )
    if off > AGREES:
        return False
    apart = abs(before_a - before_b) / math.hypot(u_before_a, u_before_b)
    changed = min(
        abs(after_a - before_a) / math.hypot(u_after_a, u_before_a),
        abs(after_b - before_b) / math.hypot(u_after_b, u_before_b),
    )
    return min(apart, changed) > CHANGES or _noises_are(series, names, part, row, noise_changes)


def _noises_are(series: Series, names: tuple[str, str], part: slice, row: int, noise_changes: float) -> bool:
    """Whether the noises of two outputs of different noise are exchanged at a row."""
    before, after = zip(*(beside(series.outputs[name][part], row) for name in names), strict=True)
    noises = [spread_of(each) for each in (*before, *after)]
    if min(noises) <= 0:
        return False
    first, then = (float(np.log(noises[k] / noises[k + 1])) for k in (0, 2))
    u = U_LOG_NOISE * 2.0 / np.sqrt(min(len(each) for each in (*before, *after)))
    return abs(first) > noise_changes * u and abs(first + then) < NOISE_CHANGES * u
