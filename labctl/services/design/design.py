"""Design a campaign: the cheapest recipe on a bench that reaches an uncertainty, or the best within given hours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import tomli_w

from instruments.bench_config import USUAL_AIR_TAU_S, BenchFile
from instruments.positions import Position
from labctl.answers.design import (
    DesignBound,
    DesignedCampaign,
    DesignPrior,
    DesignRequest,
    DesignResponse,
    Range,
    TiltedDesign,
)
from labctl.errors import BadInput, LabctlError
from labctl.fitting.data.channels import BODY_AXES
from labctl.fitting.design.bound import least_heat_h, u_of_one_hour_dps
from labctl.fitting.design.heat_course import HeatFlow
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.models.presets import POSES, preset_for
from labctl.services.cache import UNNAMED, compute
from labctl.services.design.further_sections import further_sections
from labctl.services.design.known import Known, known_noise
from labctl.services.design.problem import NOT_POSSIBLE, Candidate, Goal, Problem
from labctl.services.design.search import chosen, next_best, search
from labctl.services.design.sentences import decisions
from labctl.services.design.tilted_fixture import TiltedChoice, is_useful, tilted_choice
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.fit_rules import check_fit
from labctl.services.planning.loading import bench_for, limits_of, load_bench, load_recipe
from labctl.services.planning.plan_answer import misalignment_outlook
from procedures.contracts.errors import PlanRefused
from procedures.contracts.steps import Mount
from procedures.planning.limits import BenchLimits, missing_instruments
from procedures.planning.step_writer import MOUNTING_S
from procedures.recipe.fit_rules import FitRules
from procedures.recipe.recipe import Recipe, recipe_document
from procedures.recipe.schemes import Span, scheme_text

if TYPE_CHECKING:
    from labctl.services.design.type_prior import TypePrior
    from labctl.store import Store

#: The recipe that a design without another one is compared with, and the model of a design without one.
REFERENCE, USUAL_MODEL = "table1-x-table2", "bias_scale"
#: Models that have a table over temperature: their data sets have to be at fixed temperatures.
TABLES = frozenset({"yang2018", "weiss1995"})
#: Models that no campaign on a rate table is designed for, and why.
NOT_DESIGNED = {
    "single_temperature": "it says nothing of other temperatures",
    "turns": "it is for turns by hand",
    "bias": "it has no law of temperature",
    POSES: "it is for poses by hand",
}
#: Lines of the comparison.
COMPARED = 5


def design_campaign(store: Store | None, request: DesignRequest, bench: BenchFile | None) -> DesignResponse:
    """Return the recipe that reaches a goal, and what it was compared with.

    Without a bench it is the simulated one that fits best. Raises RecipeError, BadBench, BadInput, PlanRefused.
    """
    posed = pose(store, request, bench)
    problem, goal = posed.problem, Goal(request.u_dps, request.hours)
    ramps = problem.model not in TABLES and problem.base.order == "position-major"
    without = None
    if posed.of_type is not None:
        without = chosen(search(replace(problem, prior=None, evaluated={}), goal, ramps=ramps), goal)
        if without is not None and without.scheme is not None:
            problem.candidate(without.scheme)  # the search may miss it; with the prior it is no worse
    tried = search(problem, goal, ramps=ramps)
    choice = chosen(tried, goal)
    if choice is None:
        raise _nothing(problem, goal, tried)
    tilted = tilted_choice(problem, goal, tried) if ramps else None
    outcome = _Found(problem, goal, tried, choice, tilted, posed.bench.units_at_once)
    answer = _answer(outcome, posed.bench, posed.known, posed.like)
    if posed.of_type is None:
        return answer
    return answer.model_copy(update={"type_prior": DesignPrior(
        type=posed.of_type.type, model=posed.of_type.model, units=posed.of_type.prior.units,
        without=None if without is None else outcome.designed(without),
    )})  # fmt: skip


@dataclass(frozen=True)
class Posed:
    """A problem, its bench, what is known of the noise there and of the type, and the recipe that it is like."""

    problem: Problem
    bench: BenchFile
    known: Known
    like: Recipe | None
    of_type: TypePrior | None  #: what the type of a unit says of the coefficients


def pose(store: Store | None, request: DesignRequest, bench: BenchFile | None) -> Posed:
    """Return what decides what a recipe costs and gives. Raises RecipeError, BadBench, BadInput, PlanRefused."""
    like = None if request.like is None else load_recipe(request.like)
    if like is not None:
        check_fit(like)
    model, effects = _model(request, like)
    on = bench or load_bench(bench_for(like or load_recipe(REFERENCE), driven=True))
    limits = limits_of(on, driven=True, earlier=None if store is None else times_on_bench(store, on))
    base, span = _base_and_span(request, like, on, limits)
    axes = _outputs(base, on)
    known = known_noise(store, on, axes, request.prior, span)
    flow = HeatFlow(limits.ramp_c_per_min, USUAL_AIR_TAU_S if on.air_tau_s is None else on.air_tau_s)
    used = tuple(each for each in BODY_AXES if each in {Position.of(position).axis for position in base.positions})
    supply_v = None if on.supply is None else on.supply.nominal_v
    use = RangeOfUse(used, span.rate_dps, (span.low_c, span.high_c), supply_v)
    name = f"{base.name}-designed"
    useful = tuple(each for each in on.tilted_positions if is_useful(base.positions, axes, each))
    problem = Problem(
        base, span, model, effects, axes, limits, flow, known.noise, use, name, useful,
        further=further_sections(effects, base, span, on),
    )  # fmt: skip
    of_type = _prior(store, request, model, effects, axes)
    problem = problem if of_type is None else replace(problem, prior=of_type.prior)
    return Posed(problem, on, known, like, of_type)


def designed(store: Store, request: DesignRequest, bench: BenchFile | None) -> DesignResponse:
    """Return the same, for a client that waits: in a process for computations. Raises what `design_campaign` raises."""
    compute(UNNAMED)
    return design_campaign(store, request, bench)


@dataclass(frozen=True)
class _Found:
    problem: Problem
    goal: Goal
    tried: list[Candidate]
    choice: Candidate
    tilted: TiltedChoice | None
    units: int  #: measured at once

    def designed(self, candidate: Candidate) -> DesignedCampaign:
        """Return a recipe with its figures."""
        return designed_campaign(candidate, self.goal, self.units)


def _prior(
    store: Store | None, request: DesignRequest, model: str | None, effects: tuple[str, ...], axes: tuple[str, ...]
) -> TypePrior | None:
    """Return what the type of a unit says of the model, if it is asked for. Raises BadInput, NotEnoughData.

    A prior that knows none of the outputs `axes` is refused, as the fit of the recipe would refuse it.
    """
    if request.type_prior is None:
        return None
    from labctl.services.design.type_prior import prior_of_type  # noqa: PLC0415  slow to load, seldom needed

    if store is None:
        raise BadInput(
            f"type {request.type_prior!r}: there is no database with calibrated units; name one with --database"
        )
    found = prior_of_type(store, request.type_prior, model, effects)
    if not any(found.prior.known(axis) for axis in axes):
        outputs = ", ".join(sorted({name.partition(".")[0] for name in found.prior.names}))
        raise BadInput(
            f"type {request.type_prior!r}: its calibrated units have output {outputs}, but the recipe on this bench is "
            f"for output {', '.join(axes)}, of which they say nothing; name a bench for such units with --bench, or "
            "leave the prior out"
        )
    return found


def _model(request: DesignRequest, like: Recipe | None) -> tuple[str | None, tuple[str, ...]]:
    """Return the model to fit and the effects beside it. Raises BadInput for one that cannot be designed for."""
    model, effects = request.model, tuple(request.effects)
    if model is None and not effects:
        fit = None if like is None else like.fit
        model, effects = (USUAL_MODEL, ()) if fit is None else (fit.model, fit.effects)
    preset_for(model, list(effects))
    if (why := NOT_DESIGNED.get(model or "")) is not None:
        raise BadInput(f"model {model}: no campaign on a rate table is designed for it, because {why}; name another")
    return model, effects


def _base_and_span(
    request: DesignRequest, like: Recipe | None, bench: BenchFile, limits: BenchLimits
) -> tuple[Recipe, Span]:
    """Return the recipe that a scheme says nothing of, and what has to be covered."""
    if like is not None and like.turns is not None:
        raise BadInput(f"recipe {like.name}: turns by hand need no table; choose a recipe with rates and temperatures")
    outputs = sorted({axis for gyro in bench.gyros for axis in gyro.axes})
    rates, temperatures = request.rates_dps, request.temperatures_c
    if like is not None:
        base = like
        rates = rates or (min(like.rates_dps), max(like.rates_dps))
        temperatures = temperatures or (min(like.temperatures_c), max(like.temperatures_c))
    else:
        rates, temperatures = rates or allowed_rates(limits), temperatures or allowed_temperatures(limits)
        usual = load_recipe(REFERENCE).model_dump() | {"fit": None}
        base = Recipe.model_validate({**usual, "name": request.model or "effects", "positions": outputs})
    if missing := missing_instruments(base, limits):
        raise PlanRefused(base.name, missing, "Name a bench with a rate table and a chamber.")
    if temperatures[0] >= temperatures[1]:
        raise BadInput(
            f"temperatures {temperatures[0]:g} to {temperatures[1]:g} deg C: a design needs a range; give "
            "--temperatures LOW,HIGH"
        )
    span = Span(max(abs(rates[0]), abs(rates[1])), temperatures[0], temperatures[1])
    _refuse_beyond(base, span, limits)
    return base, span


def _refuse_beyond(base: Recipe, span: Span, limits: BenchLimits) -> None:
    """Raise PlanRefused for a range that the bench or a unit cannot have."""
    allowed = base.guards.max_rate_error_fraction
    complaints = [(f"rates {span.rate_dps:g} deg/s", limits.rate_complaint(span.rate_dps, allowed))]
    complaints += [(f"temperatures {c:g} deg C", limits.temperature_complaint(c)) for c in (span.low_c, span.high_c)]
    if beyond := [f"{name}: {text}" for name, text in complaints if text]:
        raise PlanRefused(base.name, beyond, "Give --rates LOW,HIGH or --temperatures LOW,HIGH within the limits.")


def allowed_rates(limits: BenchLimits) -> Range:
    """Return the lowest and the highest rate of a bench and its units, deg/s."""
    rates: list[float] = [gyro.max_rate_dps for gyro in limits.gyros.values()]
    if limits.table is not None:
        rates.append(limits.table.max_rate_dps)
    largest = min(rates)
    return -largest, largest


def allowed_temperatures(limits: BenchLimits) -> Range:
    """Return the lowest and the highest temperature of a bench and its units, deg C."""
    ends = [(gyro.min_c, gyro.max_c) for gyro in limits.gyros.values()]
    ends += [] if limits.chamber is None else [(limits.chamber.min_c, limits.chamber.max_c)]
    return max(low for low, _ in ends), min(high for _, high in ends)


def _outputs(base: Recipe, bench: BenchFile) -> tuple[str, ...]:
    """Return the outputs of the unit with most of them; a unit that is turned about another axis has no law of it."""
    unit = max(bench.gyros, key=lambda gyro: len(gyro.axes))
    turned = {Position.of(position).axis for position in base.positions}
    if not turned & set(unit.axes):
        raise BadInput(
            f"recipe {base.name} turns the units about {', '.join(sorted(turned))}, but unit {unit.name} of bench "
            f"{bench.name} measures {', '.join(unit.axes)}; name a recipe with its axes, or another bench"
        )
    return tuple(axis for axis in unit.axes if axis in turned)


def _nothing(problem: Problem, goal: Goal, tried: list[Candidate]) -> BadInput:
    """Return the error of a design without a recipe."""
    if not tried:
        return BadInput(
            f"no recipe that bench and units can run determines model {problem.model or 'of the effects'} over "
            f"{problem.span.low_c:g} to {problem.span.high_c:g} deg C and {problem.span.rate_dps:g} deg/s; choose "
            "another model, or a wider range"
        )
    shortest = min(tried, key=lambda each: each.hours)
    return BadInput(
        f"hours = {goal.hours:g} h: the shortest recipe found takes {shortest.hours:.1f} h; give at least so many"
    )


def _answer(outcome: _Found, bench: BenchFile, known: Known, like: Recipe | None) -> DesignResponse:
    problem, goal, choice = outcome.problem, outcome.goal, outcome.choice
    recipe = choice.recipe
    reference, refused = _reference(problem, like)
    outlook = misalignment_outlook(choice.plan, bench, problem.limits)
    scheme = choice.scheme
    return DesignResponse(
        bench=bench.name,
        model=problem.model,
        effects=[] if scheme is None else list(problem.effects_of(scheme)),
        rates_dps=(-problem.span.rate_dps, problem.span.rate_dps),
        temperatures_c=(problem.span.low_c, problem.span.high_c),
        is_reached=goal.reached_by(choice),
        chosen=outcome.designed(choice),
        recipe_toml=tomli_w.dumps(recipe_document(recipe)),
        schedule_hash=choice.plan.schedule_hash,
        decisions=list(decisions(problem, outcome.tried, choice, goal)),
        others=[outcome.designed(each) for each in next_best(outcome.tried, choice, goal, COMPARED)],
        reference=None if reference is None else outcome.designed(reference),
        reference_name=REFERENCE if like is None else like.name,
        reference_refused=refused,
        bound=_bound(problem, goal, choice),
        tilted=None if outcome.tilted is None else _tilted(outcome, outcome.tilted),
        units_at_once=outcome.units,
        standards_u_dps=None if outlook is None else outlook.expanded * problem.span.rate_dps,
        assumptions=[*known.sources, _heat_text(problem.flow, bench), _units_text(bench)],
        tried=len(outcome.tried),
    )


def _tilted(outcome: _Found, tilted: TiltedChoice) -> TiltedDesign:
    return TiltedDesign(
        position=tilted.position,
        is_on_bench=tilted.is_on_bench,
        best=outcome.designed(tilted.best),
        recipe_toml=tomli_w.dumps(recipe_document(tilted.best.recipe)),
        without=None if tilted.without is None else outcome.designed(tilted.without),
        bound=_bound(tilted.problem, outcome.goal, tilted.best),
    )


def designed_campaign(candidate: Candidate, goal: Goal, units: int) -> DesignedCampaign:
    """Return what a recipe for so many units at once costs and gives, as an answer states it."""
    predicted = candidate.predicted
    return DesignedCampaign(
        text=candidate.recipe.description if candidate.scheme is None else scheme_text(candidate.scheme),
        hours=candidate.hours, hours_per_unit=candidate.hours / units,
        u_worst_dps=predicted.worst_dps, u_rms_dps=predicted.rms_dps, u_heat_dps=predicted.heat_rms_dps,
        worst_axis=predicted.worst_axis,
        worst_temperature_c=predicted.worst_temperature_c, datasets=candidate.plan.datasets,
        coefficients=predicted.coefficients, mountings=_mountings(candidate), covered_c=candidate.covered_c,
        is_reaching=goal.reached_by(candidate),
    )  # fmt: skip


def _mountings(candidate: Candidate) -> int:
    return sum(isinstance(step, Mount) for step in candidate.plan.steps)


def _reference(problem: Problem, like: Recipe | None) -> tuple[Candidate | None, str]:
    """Return what the recipe costs and gives that a design is compared with; else why it cannot be run or fitted."""
    recipe = load_recipe(REFERENCE) if like is None else like
    try:
        plain = recipe.model_copy(update={"fit": FitRules(model=problem.model, effects=problem.effects)})
        return problem.of_recipe(plain, None, problem.effects), ""
    except NOT_POSSIBLE as error:
        return None, str(error)


def _bound(problem: Problem, goal: Goal, choice: Candidate) -> DesignBound | None:
    """Return the least hours for the goal, or for what the chosen recipe gives where it does not reach one.

    With a tilted fixture the temperature goes through the range in one mounting.
    """
    wanted = max(goal.u_dps or 0.0, choice.predicted.worst_dps)
    positions = (*problem.base.positions, *problem.tilted)
    try:
        preset = preset_for(problem.model, list(problem.effects))
        hour = u_of_one_hour_dps(positions, problem.axes, preset, problem.noise, problem.use)
    except LabctlError:
        return None
    noise_h = (hour / wanted) ** 2
    heated = 1 if problem.tilted else len(problem.base.positions)
    handling_c = problem.base.mounting.handling_c
    heat_h = least_heat_h(heated, problem.use.temperature_c, handling_c, problem.limits.ramp_c_per_min)
    heat_h += len(positions) * MOUNTING_S / 3600.0 if problem.limits.needs_person else 0.0
    bound_h = max(noise_h, heat_h)
    return DesignBound(noise_h=noise_h, heat_h=heat_h, bound_h=bound_h, ratio=choice.hours / bound_h)


def _units_text(bench: BenchFile) -> str:
    stated = bench.table is not None and bench.table.places is not None
    source = "table.places of the bench file" if stated else "those in the bench file, which states no table.places"
    at_once = "1 unit" if bench.units_at_once == 1 else f"{bench.units_at_once} units"
    return f"{at_once} at once ({source}); a person mounts all of them in {MOUNTING_S / 60:g} min (assumed)"


def _heat_text(flow: HeatFlow, bench: BenchFile) -> str:
    air = "as the bench file states" if bench.air_tau_s is not None else "assumed"
    return (
        f"the air follows the ramp of {flow.ramp_c_per_min:g} K/min with {flow.air_tau_s:g} s ({air}), the unit the "
        f"air with {flow.unit_tau_s:g} s (assumed)"
    )
