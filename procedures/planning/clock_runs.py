"""The runs that time a table's step clock: how many, how long, and how often in a plan."""

from __future__ import annotations

#: Runs before the first data set, and in each later block: short and long in turn.
FIRST_RUNS, LATER_RUNS = 4, 2
#: Between two blocks at least, s.
BLOCK_EVERY_S = 7200.0
#: No two runs are of one length: a reply that is late by the phase of a timer, up to this, is not equally late in all.
DITHER_S = 0.1
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def run_lengths_s(runs: int, before: int, short_s: float, longer_s: float) -> tuple[float, ...]:
    """Return the steady parts of some runs, s, of which `before` were planned earlier: short and long in turn."""
    return tuple(
        round(short_s + longer_s * (n % 2) + DITHER_S * (n * GOLDEN % 1.0), 4) for n in range(before, before + runs)
    )
