"""What a scheme does and why it was chosen, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from labctl.services.design.problem import COVERED_K, OF_MOVING_HEAT, Candidate, Goal, Problem
from labctl.services.design.search import RATES, TEMPERATURES, chosen
from procedures.recipe.schemes import Cycle, Levels, Scheme

FEWEST = "; the fewest between which the U of a finished calibration is known everywhere"


def decisions(problem: Problem, candidates: Sequence[Candidate], choice: Candidate, goal: Goal) -> Iterator[str]:
    """Yield each choice of a recipe with its reason."""
    scheme = choice.scheme
    assert scheme is not None
    yield _goal(choice, goal)
    yield _kind(candidates, choice, goal)
    yield from _of_cycle(problem, scheme, choice) if isinstance(scheme, Cycle) else _of_levels(problem, scheme)
    yield _rates(scheme)
    yield _duration(problem, scheme)
    if choice.predicted.heat_rms_dps > 0.5 * choice.predicted.rms_dps:
        yield (
            f"Unsettled heat makes {choice.predicted.heat_rms_dps:.2g} of the {choice.predicted.rms_dps:.2g} deg/s: an "
            "earlier calibration (--prior), or a model with thermal_lag, would say more than further data sets."
        )


def _goal(choice: Candidate, goal: Goal) -> str:
    predicted, hours = choice.predicted, choice.hours
    where = f"output {predicted.worst_axis} at {predicted.worst_temperature_c:.0f} deg C"
    head = f"U is at most {predicted.worst_dps:.2g} deg/s ({where}) after {hours:.1f} h"
    if goal.u_dps is None:
        return f"{head}, the smallest found within {goal.hours:g} h.{_missed(choice)}"
    if goal.reached_by(choice):
        return f"{head}, the shortest recipe found that reaches {goal.u_dps:g} deg/s."
    within = f" within {goal.hours:g} h" if goal.hours is not None else ""
    return f"{head}; no recipe found reaches {goal.u_dps:g} deg/s{within}, and this one comes closest.{_missed(choice)}"


def _missed(choice: Candidate) -> str:
    if choice.missed_k <= COVERED_K:
        return ""
    return " It does not reach the goal: no recipe of so few hours brings the unit to the ends of the range."


def _kind(candidates: Sequence[Candidate], choice: Candidate, goal: Goal) -> str:
    other = chosen([each for each in candidates if type(each.scheme) is not type(choice.scheme)], goal)
    moving = isinstance(choice.scheme, Cycle)
    name = "Data are taken while the temperature moves" if moving else "Data are taken at fixed temperatures"
    rival = "fixed temperatures" if moving else "a moving temperature"
    if other is None:
        reason = "the model is a table over temperature" if not moving else "no recipe with fixed temperatures is left"
        return f"{name}: {reason}."
    reach = "" if goal.u_dps is None or goal.reached_by(other) else ", which does not reach the goal"
    return (
        f"{name}: the best recipe with {rival} takes {other.hours:.1f} h for U = {other.predicted.worst_dps:.2g} deg/s"
        f"{reach}."
    )


def _of_cycle(problem: Problem, scheme: Cycle, choice: Candidate) -> Iterator[str]:
    if scheme.tilted:
        yield (
            f"The temperature moves with {scheme.tilted} up alone, where all three axes turn with the table: this "
            "shows how their scale factors change, as misalignments are constant in the model. The mountings with each "
            "axis up, at the temperature where units are mounted, separate the nine elements of the matrix, and from "
            "them the angle of the tilted fixture."
        )
    yield (
        "Each temperature is passed while warming and while cooling: an element that follows the thermometer late then "
        "makes opposite errors, which cancel."
    )
    if scheme.dwell_s or scheme.first_dwell_s:
        yield f"The chamber stays at either end while data go on: {_dwells(scheme)}. {_covers(problem, choice)}"
    if OF_MOVING_HEAT in problem.effects_of(scheme) and OF_MOVING_HEAT not in problem.effects:
        yield (
            f"The fit also has {OF_MOVING_HEAT}, what heat flow does to the bias; the calibration does not contain it."
        )


def _dwells(scheme: Cycle) -> str:
    if not scheme.first_dwell_s:
        return f"{scheme.dwell_s / 60:g} min"
    others = f"{scheme.dwell_s / 60:g} min in the others" if scheme.dwell_s else "not in the others"
    return f"{(scheme.dwell_s + scheme.first_dwell_s) / 60:g} min in the first mounting, {others}"


def _covers(problem: Problem, choice: Candidate) -> str:
    follows = f"The unit, which follows with {problem.flow.unit_tau_s / 60:g} min, "
    if choice.missed_k > COVERED_K:
        return f"{follows}stays {choice.missed_k:.0f} K away from an end of the range: no calibration is valid there."
    return f"{follows}is then once within {COVERED_K:g} K of either end of the range, where the calibration is valid."


def _of_levels(problem: Problem, scheme: Levels) -> Iterator[str]:
    yield (
        f"{scheme.temperatures} temperatures, denser towards the ends, where a polynomial is known least"
        f"{FEWEST if scheme.temperatures == TEMPERATURES[0] else ''}."
    )
    soak = scheme.soak
    yield (
        f"Soaks of {soak.hold_s / 60:g} min: a unit with a time constant of {problem.flow.unit_tau_s / 60:g} min then "
        f"changes by less than {soak.max_drift_c:g} K in {soak.window_s / 60:g} min, which the soak also demands."
    )


def _rates(scheme: Scheme) -> str:
    order = (
        "the signs in turn, so that drift is alike in neighbours"
        if isinstance(scheme, Cycle)
        else "in random order, so that drift is not taken for a law of the rate"
    )
    fewest = (
        "the fewest between which the U of a finished calibration is known"
        if scheme.rates == RATES[0]
        else "denser towards the largest"
    )
    return f"{scheme.rates} rates of both signs and rest, {fewest}; {order}."


def _duration(problem: Problem, scheme: Scheme) -> str:
    figures = problem.noise.of(problem.axes[0])
    white = figures.white_dps_rthz / scheme.duration_s**0.5
    return (
        f"Data sets of {scheme.duration_s:g} s: white noise leaves {white:.2g} deg/s in a mean, beside a drift of "
        f"{figures.drift_dps:.2g} deg/s between data sets, which a longer one does not make smaller."
    )
