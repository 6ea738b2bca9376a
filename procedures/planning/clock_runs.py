"""The runs that time a table's step clock: how many, how long, and how often in a plan."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Runs before the first data set, and in each later block: short and long in turn.
FIRST_RUNS, LATER_RUNS = 4, 2
#: Between two blocks at least, s.
BLOCK_EVERY_S = 7200.0
#: No two runs are of one length: a reply that is late by the phase of a timer, up to this, is not equally late in all.
DITHER_S = 0.1
#: Its step when lengths are drawn, s: what is sent to a controller is rounded to whole steps anyway.
DITHER_STEP_S = 1e-4
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def run_lengths_s(runs: int, before: int, short_s: float, longer_s: float) -> tuple[float, ...]:
    """Return the steady parts of some runs, s, of which `before` were planned earlier: short and long in turn."""
    return tuple(
        round(short_s + longer_s * (n % 2) + DITHER_S * (n * GOLDEN % 1.0), 4) for n in range(before, before + runs)
    )


def drawn_lengths_s(planned_s: Sequence[float], rng: np.random.Generator) -> tuple[float, ...]:
    """Return planned lengths, s, each with a part added that is drawn from 0 to `DITHER_S`.

    Late replies are then independent of each other, also where they wait for the ticks of a timer, and the scatter of
    the runs is what their mean is uncertain by (GUM 4.2.3).
    """
    added_s = DITHER_STEP_S * rng.integers(0, round(DITHER_S / DITHER_STEP_S), len(planned_s))
    return tuple(round(steady_s + float(more_s), 4) for steady_s, more_s in zip(planned_s, added_s, strict=True))
