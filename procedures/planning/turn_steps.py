"""The steps of a recipe of turns by hand: the units placed in each position, then one turn after the other."""

from __future__ import annotations

from collections.abc import Iterator

from procedures.contracts.steps import Mount, PowerOff, PowerOn, SafeState, Step, Turn
from procedures.recipe.recipe import Recipe
from procedures.recipe.turns import TurnRules

# What is expected of a hand; only the forecast depends on it.
PLACING_S, READING_S, HAND_DPS = 30.0, 10.0, 90.0
#: Data sets of one turn: the rest before, the turn, the rest after.
DATA_SETS_OF_TURN = 3


def turn_steps(recipe: Recipe, rules: TurnRules, *, needs_person: bool = True) -> Iterator[Step]:
    """Yield the steps in order, with the time that each is expected to take.

    `needs_person`: a person places the units, which takes time.
    """
    placing_s = PLACING_S if needs_person else 0.0
    run, turn = 0, 0
    for mounting, position in enumerate(recipe.positions, start=1):
        again = run == 0 or recipe.mounting.repower_each
        if run and again:
            yield PowerOff(run=run)
        run += int(again)
        yield Mount(position=position, mounting=mounting, run=run, expected_s=placing_s)
        if again:
            yield PowerOn(run=run, wait_s=recipe.warm_up_s, expected_s=recipe.warm_up_s)
        for turn_deg in rules.turns_deg * rules.repeats:
            yield Turn(
                dataset=DATA_SETS_OF_TURN * turn + 2,
                position=position,
                run=run,
                mounting=mounting,
                turn_deg=turn_deg,
                turn_u_deg=rules.u_deg,
                rest_s=rules.rest_s,
                within_s=rules.within_s,
                expected_s=2 * rules.rest_s + READING_S + abs(turn_deg) / HAND_DPS,
            )
            turn += 1
    yield SafeState()
