"""What a design is asked for, and what one scheme costs and gives on the bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from pydantic import ValidationError

from labctl.errors import LabctlError
from labctl.fitting.design.heat_course import HeatFlow
from labctl.fitting.design.noise_figures import NoiseFigures
from labctl.fitting.design.predicted_uncertainty import PredictedUncertainty, predicted_uncertainty
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.models.presets import preset_for
from labctl.services.design.foreseen_sets import foreseen_sets
from procedures.contracts.errors import ProcedureError
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.fit_rules import FitRules
from procedures.recipe.recipe import Recipe
from procedures.recipe.schemes import Cycle, Scheme, Span, recipe_of

#: What says that a recipe cannot be run on the bench, or not fitted; any other error is one of the code.
NOT_POSSIBLE = (LabctlError, ProcedureError, ValidationError, np.linalg.LinAlgError)
#: Fitted beside a model without a thermal response where data are taken while the temperature moves: what heat flow
#: itself does to the bias; a calibration does not contain it.
OF_MOVING_HEAT = "temperature_rate"
#: A calibration is valid where its unit has been: that has to be within this of the ends of the range, K.
COVERED_K = 2.0
#: Effects of a model that describe the unit while its temperature moves.
THERMAL = frozenset({OF_MOVING_HEAT, "thermal_lag", "thermal_lag_two_ways"})


@dataclass(frozen=True)
class Goal:
    """What is asked for: at least one of the two."""

    u_dps: float | None  #: U (k = 2) of each component of the corrected rate vector, everywhere in the range
    hours: float | None  #: bench hours at most

    def reached_by(self, candidate: Candidate) -> bool:
        """Return whether a candidate is good enough, short enough, and covers the range."""
        if candidate.missed_k > COVERED_K:
            return False
        good = self.u_dps is None or candidate.predicted.worst_dps <= self.u_dps
        return good and (self.hours is None or candidate.hours <= self.hours)


@dataclass(frozen=True)
class Candidate:
    """A recipe on the bench, and what it is expected to cost and to give."""

    scheme: Scheme | None  #: None: a recipe that was given
    plan: Plan
    predicted: PredictedUncertainty
    covered_c: tuple[float, float]  #: lowest and highest temperature of the unit in a data set
    missed_k: float  #: by how much the unit stays away from an end of the range, K

    @property
    def recipe(self) -> Recipe:
        """The recipe."""
        return self.plan.recipe

    @property
    def hours(self) -> float:
        """Expected duration, h."""
        return self.plan.expected_s / 3600.0


@dataclass(frozen=True)
class Problem:
    """Everything that decides what a scheme costs and gives."""

    base: Recipe  #: what the schemes say nothing of is as in it
    span: Span
    model: str | None
    effects: tuple[str, ...]
    axes: tuple[str, ...]  #: outputs
    limits: BenchLimits
    flow: HeatFlow
    noise: NoiseFigures
    use: RangeOfUse
    name: str
    tilted: tuple[str, ...] = ()  #: directions that a tilted fixture brings up, of which one may be chosen
    prior: CoefficientPrior | None = None  #: what the type says of the coefficients; the recipe is fitted with it
    further: Mapping[str, object] = field(default_factory=dict)  #: sections of every recipe (`further_sections`)
    evaluated: dict[Scheme, Candidate | None] = field(default_factory=dict)  #: those that cannot be run are None

    def with_fixture(self, position: str) -> Problem:
        """Return the same problem on a bench with a tilted fixture."""
        limits = replace(self.limits, tilted_positions=(*self.limits.tilted_positions, position))
        return replace(self, limits=limits, tilted=(position,), evaluated={})

    def effects_of(self, scheme: Scheme) -> tuple[str, ...]:
        """Return the effects that are fitted beside the model to the recipe of a scheme."""
        known = {effect.partition(":")[0] for effect in self.effects}
        adds = isinstance(scheme, Cycle) and not known & THERMAL
        return (*self.effects, OF_MOVING_HEAT) if adds else self.effects

    def candidate(self, scheme: Scheme) -> Candidate | None:
        """Return what a scheme costs and gives; None where the bench cannot run it, or it does not fit the model."""
        if scheme not in self.evaluated:
            try:
                self.evaluated[scheme] = self._evaluate(scheme)
            except NOT_POSSIBLE:
                self.evaluated[scheme] = None
        return self.evaluated[scheme]

    def _evaluate(self, scheme: Scheme) -> Candidate:
        effects = self.effects_of(scheme)
        recipe = recipe_of(
            scheme, self.base, self.span, name=self.name,
            fit=FitRules(model=self.model, effects=effects, type_prior=self.prior is not None),
            ramp_c_per_min=self.limits.ramp_c_per_min, further=self.further,
        )  # fmt: skip
        return self.of_recipe(recipe, scheme, effects)

    def of_recipe(self, recipe: Recipe, scheme: Scheme | None, effects: tuple[str, ...]) -> Candidate:
        """Return what a recipe costs and gives. Raises PlanRefused, NotEnoughData."""
        plan = make_plan(recipe, self.limits)
        nominal_v = None if self.limits.supply is None else self.limits.supply.nominal_v
        sets = foreseen_sets(plan, self.flow, self.limits.max_acceleration_dps2, nominal_v)
        preset = preset_for(self.model, list(effects))
        predicted = predicted_uncertainty(sets, self.axes, preset, self.noise, self.use, self.prior)
        low_c, high_c = float(sets.temperature_c.min()), float(sets.temperature_c.max())
        missed_k = max(low_c - self.span.low_c, self.span.high_c - high_c, 0.0)
        return Candidate(scheme, plan, predicted, (low_c, high_c), missed_k)
