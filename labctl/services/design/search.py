"""The search over the schemes: one number of a scheme is exchanged at a time, for what helps most.

What helps is hours times a power of U over the goal. Several powers lead from cheap recipes to exact ones; the choice
is made among all recipes that were tried on the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

from labctl.services.design.problem import COVERED_K, Candidate, Goal, Problem
from procedures.recipe.schemes import Cycle, Levels, Scheme, Soak

SchemeT = TypeVar("SchemeT", Levels, Cycle)

#: Rates and temperatures: with fewer, the uncertainty of the finished calibration would not be known between them (it
#: needs data sets near: `labctl.fitting.uncertainty.local_model_error`), and a curve would not show.
RATES, TEMPERATURES = (7, 9, 11), (5, 6, 7, 8, 10)
#: Shorter data sets are no better: the drift between them remains, and the one correlation time of a fit's drift would
#: be that of its fast part.
DURATIONS_S = (60.0, 90.0, 120.0)
HOLDS_S = (300.0, 600.0, 900.0, 1200.0, 1800.0, 2700.0, 3600.0)
DWELLS_S = (0.0, 120.0, 240.0, 420.0, 600.0, 900.0, 1200.0, 1500.0, 1800.0, 2400.0, 3600.0)
RAMP_SHARES = (1.0, 0.6, 0.35)
CYCLES, REPEATS = (1, 2), (1, 2, 3)
#: Powers of U in what the exchange makes small.
POWERS = (0.5, 3.0)
#: Weight of what must not be: hours beyond those given, and ends of the range that are missed.
MUST = 20.0
#: Rounds of exchanges at most, and what an exchange must gain.
ROUNDS, GAIN = 6, 1e-6
#: A recipe is worth a line beside another one where hours and U both differ by more than this share.
WORTH = 0.05
#: A unit may still change by so much more over the window than is expected.
DRIFT_MARGIN = 1.5

Cost = Callable[[Candidate], float]


def search(problem: Problem, goal: Goal, *, ramps: bool) -> list[Candidate]:
    """Return every recipe that was tried and can be run; with `ramps` also those that measure while it warms."""
    for power in POWERS:
        cost = _cost(goal, power)
        begin = Levels(TEMPERATURES[0], soaks(problem, TEMPERATURES[0])[3], RATES[0], 60.0)
        _exchanged(problem, begin, cost, _of_levels)
        if ramps:
            stays = (0.0, DWELLS_S[-3]) if len(problem.base.positions) > 1 else (DWELLS_S[-3], 0.0)
            _exchanged(problem, Cycle(RATES[0], 60.0, *stays), cost, _of_cycles)
    search_tilted(problem, goal)
    return [candidate for candidate in problem.evaluated.values() if candidate is not None]


def search_tilted(problem: Problem, goal: Goal) -> list[Candidate]:
    """Return every recipe tried that moves the temperature in a tilted mounting alone."""
    for tilted in problem.tilted:
        for power in POWERS:
            begin = Cycle(RATES[0], 60.0, DWELLS_S[-3], 0.0, tilted=tilted)
            _exchanged(problem, begin, _cost(goal, power), _of_cycles)
    return [each for each in problem.evaluated.values() if each is not None and is_tilted(each)]


def is_tilted(candidate: Candidate) -> bool:
    """Return whether a recipe moves the temperature in a tilted mounting alone."""
    return isinstance(candidate.scheme, Cycle) and bool(candidate.scheme.tilted)


def chosen(candidates: Sequence[Candidate], goal: Goal) -> Candidate | None:
    """Return the cheapest candidate that reaches the goal; else the best one within the hours; None for none."""
    if goal.u_dps is not None and (enough := [each for each in candidates if goal.reached_by(each)]):
        return min(enough, key=lambda each: (each.hours, each.predicted.worst_dps))
    within = [each for each in candidates if goal.hours is None or each.hours <= goal.hours]
    within = [each for each in within if each.missed_k <= COVERED_K] or within
    return min(within, key=lambda each: (each.predicted.worst_dps, each.hours), default=None)


def next_best(candidates: Sequence[Candidate], choice: Candidate, goal: Goal, number: int) -> list[Candidate]:
    """Return recipes to compare a choice with, shortest first.

    They are the best of the other kind, and the neighbours of the choice among those that no other recipe beats in both
    hours and U.
    """
    others = [each for each in candidates if type(each.scheme) is not type(choice.scheme)]
    alternatives = [each for each in (chosen(others, goal),) if each is not None]
    front = _front([each for each in candidates if each.missed_k <= COVERED_K] or candidates)
    place = next((n for n, each in enumerate(front) if each.hours >= choice.hours), len(front))
    near = sorted(
        (each for each in front if each is not choice),
        key=lambda each: abs(front.index(each) - place),
    )
    for each in near:
        if len(alternatives) < number and each not in alternatives and _differs(each, [choice, *alternatives]):
            alternatives.append(each)
    return sorted(alternatives, key=lambda each: each.hours)


def _differs(candidate: Candidate, others: Sequence[Candidate]) -> bool:
    """Return whether a candidate is worth a line beside others: by some per cent in hours and in U."""
    return all(
        abs(math.log(candidate.hours / other.hours)) > WORTH
        and abs(math.log(candidate.predicted.worst_dps / other.predicted.worst_dps)) > WORTH
        for other in others
    )


def _front(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that no other one beats in both hours and U, shortest first."""
    front: list[Candidate] = []
    for each in sorted(candidates, key=lambda each: (each.hours, each.predicted.worst_dps)):
        if not front or each.predicted.worst_dps < front[-1].predicted.worst_dps:
            front.append(each)
    return front


def _cost(goal: Goal, power: float) -> Cost:
    """Return what an exchange makes small: log hours, and a power of U; what the goal has to spare counts nothing."""
    enough_dps = goal.u_dps or 0.0

    def cost(candidate: Candidate) -> float:
        excess = math.log(max(candidate.predicted.worst_dps, enough_dps))
        over = 0.0 if goal.hours is None else max(math.log(candidate.hours / goal.hours), 0.0)
        missed = max(candidate.missed_k - COVERED_K, 0.0) / COVERED_K
        return math.log(candidate.hours) + power * excess + MUST * (over + missed)

    return cost


def _exchanged(
    problem: Problem, begin: SchemeT, cost: Cost, exchanges: Callable[[Problem, SchemeT], list[list[SchemeT]]]
) -> SchemeT:
    """Return the scheme that exchanges of one of its numbers at a time lead to."""

    def cost_of(scheme: Scheme) -> float:
        candidate = problem.candidate(scheme)
        return math.inf if candidate is None else cost(candidate)

    best, least = begin, cost_of(begin)
    for _ in range(ROUNDS):
        before = least
        for number in range(len(exchanges(problem, best))):
            for tried in exchanges(problem, best)[number]:
                if (now := cost_of(tried)) < least - GAIN:
                    best, least = tried, now
        if least > before - GAIN:
            break
    return best


def _of_levels(problem: Problem, scheme: Levels) -> list[list[Levels]]:
    """Return the schemes that differ in one number, a list for each number."""
    return [
        [replace(scheme, temperatures=each) for each in TEMPERATURES],
        [replace(scheme, soak=each) for each in soaks(problem, scheme.temperatures)],
        [replace(scheme, rates=each) for each in RATES],
        [replace(scheme, duration_s=each) for each in DURATIONS_S],
        [replace(scheme, order="up"), replace(scheme, order="up_down")],
    ]


def _of_cycles(problem: Problem, scheme: Cycle) -> list[list[Cycle]]:
    has_further = len(problem.base.positions) > 1 and not scheme.tilted  # a single mounting is the first one
    further = DWELLS_S if has_further else ()
    return [
        [replace(scheme, rates=each) for each in RATES],
        [replace(scheme, duration_s=each) for each in DURATIONS_S],
        [replace(scheme, dwell_s=each) for each in DWELLS_S],
        [replace(scheme, first_dwell_s=each) for each in further],
        [replace(scheme, ramp_share=each) for each in RAMP_SHARES],
        [replace(scheme, cycles=each) for each in CYCLES],
        [replace(scheme, repeats=each) for each in REPEATS] if scheme.tilted else [],
    ]


def soaks(problem: Problem, temperatures: int) -> list[Soak]:
    """Return the soaks that are tried: some fixed ones, and, last, one until the unit has settled.

    Each demands of the unit's thermometer what it is expected to show then, with a margin, and no less than the recipe
    that the design is like.
    """
    rules, flow = problem.base.soak, problem.flow
    way_c = (problem.span.high_c - problem.span.low_c) / max(temperatures - 1, 1) * math.pi / 2  # the widest step
    settled_s = flow.settling_s(way_c, rules.max_drift_c, rules.drift_window_s)
    soaks_of_holds = []
    for least_s in [*HOLDS_S, settled_s]:
        hold_s = math.ceil(least_s / 60.0) * 60.0
        window_s = min(rules.drift_window_s, hold_s)
        expected_c = flow.change_c(way_c, hold_s, window_s)
        soaks_of_holds.append(Soak(hold_s, window_s, round(max(rules.max_drift_c, DRIFT_MARGIN * expected_c), 2)))
    return soaks_of_holds
