"""What a tilted fixture is worth: the design with and without it, and the least hours of both.

One tilted mounting shows a single product of the matrix of scale factors and misalignments with its direction; turned
about the table axis, or upside down, it shows the same again. Nine elements need three directions. Three mountings with
one body axis up each are the best three, since their directions are orthogonal, and no error of a fixture is in a scale
factor then; four diagonals give as much by noise in one mounting more, and have it in every element. What a tilted
mounting saves is heat: as misalignments are constant over the temperature in a model without a table, it shows how the
scale factors of all axes change in one course of the temperature, beside the straight mountings at a single one.
"""

from __future__ import annotations

from dataclasses import dataclass

from instruments.positions import AXES, Position
from labctl.services.design.problem import Candidate, Goal, Problem
from labctl.services.design.search import chosen, is_tilted, search_tilted

#: The direction that is assumed where the bench has no tilted fixture: all axes turn at 1/sqrt(3) of the rate.
DIAGONAL = "x+y+z"
#: An axis that turns at less than this share of the table's rate in a tilted mounting gains nothing.
MIN_SHARE = 0.3


@dataclass(frozen=True)
class TiltedChoice:
    """The best recipe with a tilted fixture, and the best one without."""

    position: str
    is_on_bench: bool
    best: Candidate
    without: Candidate | None
    problem: Problem  #: that of a bench with the fixture


def is_useful(base_positions: tuple[str, ...], outputs: tuple[str, ...], direction: str) -> bool:
    """Return whether a tilted mounting stands for the straight ones of a recipe: about all axes, each an output."""
    straight = {Position.of(each).axis for each in base_positions}
    return straight == set(outputs) == set(AXES) and min(map(abs, Position.of(direction).up)) >= MIN_SHARE


def tilted_choice(problem: Problem, goal: Goal, tried: list[Candidate]) -> TiltedChoice | None:
    """Return the choice with a tilted fixture, that of the bench or a diagonal; None where it has no use.

    `tried` are the recipes of the bench itself.
    """
    position = problem.tilted[0] if problem.tilted else DIAGONAL
    if not is_useful(problem.base.positions, problem.axes, position):
        return None
    having = problem if problem.tilted else problem.with_fixture(position)
    candidates = [each for each in tried if is_tilted(each)] if problem.tilted else search_tilted(having, goal)
    best = chosen(candidates, goal)
    if best is None:
        return None
    without = chosen([each for each in tried if not is_tilted(each)], goal)
    return TiltedChoice(best.recipe.positions[-1], bool(problem.tilted), best, without, having)
