"""How long data sets last in which a table makes whole turns, or at least whole cycles of its motor."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from procedures.recipe.recipe import Recipe

#: A stepper turns by this in a cycle of its motor, deg: four steps of 1.8 deg, geared down 4:1.
CYCLE_DEG = 1.8
#: A data set lasts at most so many times as long, to be of whole turns of the table, else of whole cycles of its motor.
LONGER_FOR = ((360.0, 1.5), (CYCLE_DEG, 2.0))


def over_whole_turns(recipe: Recipe, rates_dps: Iterable[float]) -> dict[str, object]:
    """Return a recipe's rules of acquisition, its data sets being of whole turns of the table at each of these rates.

    The angle of a stepper is wrong by A times a wave over each cycle of its motor, with A some 5 % of a step. Over
    whole cycles that averages out; over a part of one it makes the mean rate of a data set of duration D wrong by up to
    2 A / D, in every repetition alike, which no residual distinguishes from an error of the gyro at that rate. All
    data sets last a whole number of seconds; where no such time is near, whole cycles have to do, and else the recipe's
    own duration.
    """
    sizes, shortest_s = np.array([abs(rate) for rate in rates_dps if rate]), recipe.acquire.duration_s
    for angle_deg, times in LONGER_FOR:
        for whole_s in range(int(np.ceil(shortest_s)), int(times * shortest_s) + 1):
            cycles = sizes * whole_s / angle_deg
            if np.allclose(cycles, np.round(cycles), rtol=0, atol=1e-6):
                return {**recipe.acquire.model_dump(), "duration_s": float(whole_s)}
    return recipe.acquire.model_dump()
