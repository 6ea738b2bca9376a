"""What a type says of a unit before it is measured, and a fit that uses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from labctl.errors import BadInput
from labctl.fitting.data.channels import Argument
from labctl.fitting.data.covered import Covered
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.axis_solutions import beside, prior_rows, solve_axes
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.prior import CoefficientPrior, with_reference
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.fleet.population import Population
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import POSES, Preset, preset_for
from labctl.fitting.numeric.arrays import Array, block_diagonal
from labctl.fitting.numeric.least_squares import solve
from labctl.fitting.uncertainty.use import AxisEvidence, use_evidence
from labctl.recording import Recording

#: A prior that contradicts the data at this level, over all axes, is not used: the unit is not like its type.
CONFLICT_LEVEL = 1e-3
#: Directions of scaled columns below this share of the largest are not determined by data sets.
MIN_DIRECTION = 1e-7
#: What a coefficient that no prior knows may add to a data set, deg/s.
UNKNOWN_DPS = 1e3


@dataclass(frozen=True)
class FitWithPrior:
    """A model fitted to the means of a unit and the prior of its type."""

    fitted: FittedModel
    is_used: bool  #: whether the prior is in it; False: the unit contradicts the prior, and it is fitted alone
    p_value: float  #: of a larger contradiction between prior and data by chance, over all axes
    units: int  #: of the type that the prior is from


@dataclass(frozen=True)
class ResultWithPrior:
    """The whole result of a fit to a recording and a prior."""

    result: FitResult
    evidence: Mapping[str, AxisEvidence]  #: axis -> what the recording shows of the errors in use
    is_used: bool  #: whether the prior is in it
    p_value: float  #: of a larger contradiction between prior and data by chance, over all axes


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
        population.names, population.expected(groups or {}, on, with_bench=False), covariance, units,
        population.table.reference_temperature_c,
    )  # fmt: skip


def fit_with_prior(data: FitData, preset: Preset, prior: CoefficientPrior) -> FitWithPrior:
    """Return a model fitted to data sets and a prior; without the prior where the data contradict it.

    Raises NotEnoughData where data and prior do not determine the model, or where the data alone do not and contradict
    the prior.
    """
    model, kept = preset.build(data)
    model = prior.referred(model)
    used = data.take(kept)
    levels = [contradiction(used, model, axis, prior) for axis in used.outputs]
    p_value = min(1.0, len(levels) * min(levels))
    is_used = p_value >= CONFLICT_LEVEL
    solved = solve_axes(used, model, prior=prior if is_used else None)
    return FitWithPrior(FittedModel(model, solved.fits), is_used, p_value, prior.units)


def fit_recording_with_prior(
    recording: Recording, model: str | None, effects: list[str], prior: CoefficientPrior, argument: Argument,
    *, covered: Covered | None = None,
) -> ResultWithPrior:  # fmt: skip
    """Fit a preset, or effects, to a recording and a prior; without the prior where the data contradict it.

    `argument` is what the law is of whose coefficients the prior is of. Raises what `fit` raises, and BadInput for a
    recording or a model that the prior does not fit.
    """
    preset = preset_for(model, effects)
    if recording.info.motion == "poses" or recording.info.kind == "coefficients" or preset.name == POSES:
        raise BadInput(
            f"{recording.info.serial}: a prior of the type is for data sets at rates; leave the prior out for poses "
            "and for a table of coefficients"
        )
    data = fit_data_of(recording, covered)
    preset = with_shapes(data, preset)
    of_prior = with_reference(preset, prior)
    error_model, kept = of_prior.build(data)
    if error_model.argument != argument or not any(prior.known(axis) for axis in data.outputs):
        raise BadInput(
            f"{recording.info.serial}: the calibrated units of the type state no coefficient of model "
            f"{error_model.name} of the {error_model.argument}; calibrate units of the type with this model, or leave "
            "the prior out"
        )
    used = data.take(kept)
    levels = [contradiction(used, error_model, axis, prior) for axis in used.outputs]
    p_value = min(1.0, len(levels) * min(levels))
    is_used = p_value >= CONFLICT_LEVEL
    result = fit_preset(data, of_prior, prior) if is_used else fit_preset(data, preset)
    evidence = use_evidence(data, of_prior, prior=prior) if is_used else use_evidence(data, preset)
    return ResultWithPrior(result, evidence, is_used, p_value)


def contradiction(data: FitData, model: ErrorModel, axis: str, prior: CoefficientPrior) -> float:
    """Return the probability that data sets differ from what a prior expects of an axis by as much or more by chance.

    The directions of the coefficients that the data sets determine are estimated by them alone, and compared with the
    prior. What the data sets do not leave over, and directions that the prior does not know, say nothing.
    """
    design = axis_design(data, model, axis, known=prior.known(axis))
    more, more_u = beside(data, design)
    whole = np.column_stack([design.columns, more])
    size = np.linalg.norm(whole, axis=0)
    left, values, right = np.linalg.svd(whole / np.where(size > 0, size, 1.0), full_matrices=False)
    seen = values > MIN_DIRECTION * values[0]
    scatter = data.scatter(axis)
    if scatter.white_var is None or len(data) <= int(seen.sum()):
        return 1.0
    y = data.outputs[axis] - data.true_rate_dps(axis) - design.offset_dps
    solution = solve(left[:, seen], y, scatter)
    turned = values[seen, None] * right[seen] * np.where(size > 0, size, 0.0)  # (r, c + b): coefficients to directions
    mean, covariance = _expected(design, model, axis, prior, more_u)
    off = solution.values - turned @ mean
    spread = solution.covariance + turned @ covariance @ turned.T
    root = np.sqrt(np.diag(spread))
    chi2 = float(off / root @ np.linalg.solve(spread / np.outer(root, root), off / root))
    return float(chdtrc(len(off), chi2))


def _expected(
    design: AxisDesign, model: ErrorModel, axis: str, prior: CoefficientPrior, beside_u: Array
) -> tuple[Array, NDArray[np.float64]]:
    """Return mean and covariance of the estimated columns and of those beside them; hardly any where none is known."""
    c = design.columns.shape[1]
    rows, values = prior_rows(design, model, axis, prior)
    size = np.linalg.norm(design.columns, axis=0)
    unknown = UNKNOWN_DPS / np.where(size > 0, size, 1.0) * np.sqrt(max(len(design.columns), 1))
    scaled = rows * unknown
    covariance = np.linalg.inv(scaled.T @ scaled + np.eye(c)) * np.outer(unknown, unknown)
    whole = block_diagonal([covariance, np.diag(beside_u**2)])
    return np.concatenate([covariance @ (rows.T @ values), np.zeros(len(beside_u))]), whole
