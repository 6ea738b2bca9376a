"""What a type says of a unit before it is measured, and a fit that uses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.estimation.axis_solutions import prior_rows, solve_axes
from labctl.fitting.estimation.prior import CoefficientPrior, conflict
from labctl.fitting.fleet.population import Population
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import Preset

#: A prior that contradicts the data at this level, over all axes, is not used: the unit is not like its type.
CONFLICT_LEVEL = 1e-3


@dataclass(frozen=True)
class FitWithPrior:
    """A model fitted to the means of a unit and the prior of its type."""

    fitted: FittedModel
    is_used: bool  #: whether the prior is in it; False: the unit contradicts the prior, and it is fitted alone
    p_value: float  #: of a larger contradiction between prior and data by chance, over all axes
    units: int  #: of the type that the prior is from


def prior_of(
    population: Population, groups: Mapping[str, str | None] | None = None, on: datetime | None = None
) -> CoefficientPrior:
    """Return the prior of one more unit of a type, of some groups and to be measured on a date.

    Its covariance is that of the units about their mean, with what is uncertain of mean and spread themselves.
    """
    stretch = np.array([each.predictive_spread for each in population.coefficients])
    u_mean = np.array([each.u_mean for each in population.coefficients])
    covariance = population.estimate.correlation * np.outer(stretch, stretch) + np.diag(u_mean**2)
    units = min((each.units for each in population.coefficients), default=0)
    return CoefficientPrior(
        population.names, population.expected(groups or {}, on, with_bench=False), covariance, units
    )


def fit_with_prior(data: FitData, preset: Preset, prior: CoefficientPrior) -> FitWithPrior:
    """Return a model fitted to data sets and a prior; without the prior where the data contradict it.

    Raises NotEnoughData where data and prior do not determine the model, or where the data alone do not and contradict
    the prior.
    """
    model, kept = preset.build(data)
    model = prior.referred(model)
    used = data.take(kept)
    solved = solve_axes(used, model, prior=prior)
    p_value, axes = 1.0, len(solved.solutions)
    for axis, solution in solved.solutions.items():
        design = axis_design(used, model, axis)
        c = design.columns.shape[1]
        rows, values = prior_rows(design, model, axis, prior)
        p_value = min(p_value, axes * conflict(rows, values, solution.values[:c], solution.covariance[:c, :c])[1])
    if p_value < CONFLICT_LEVEL:
        return FitWithPrior(FittedModel(model, solve_axes(used, model).fits), False, p_value, prior.units)
    return FitWithPrior(FittedModel(model, solved.fits), True, p_value, prior.units)
