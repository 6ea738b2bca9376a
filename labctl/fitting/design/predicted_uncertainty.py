"""Uncertainty that planned data sets will leave in a corrected rate vector, by the design matrix of the fit itself.

The covariance of the coefficients is that of generalised least squares with the noise and drift that are expected; what
an element that is not as warm as its thermometer adds is common to all data sets, and enters by the derivative of the
estimate (GUM 5.2). To first order a corrected rate is off by the error of the model there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.errors import NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.design.noise_figures import NoiseFigures
from labctl.fitting.design.planned_sets import PlannedSets, planned_data
from labctl.fitting.design.range_of_use import RangeOfUse
from labctl.fitting.effects import kind_of
from labctl.fitting.estimation.axis_design import AxisDesign, axis_design
from labctl.fitting.estimation.axis_solutions import prior_rows
from labctl.fitting.estimation.prior import CoefficientPrior
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.presets import Preset
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_whitening import whitened

#: Coverage factor of U.
K = 2.0
#: Triangles with a smaller diagonal than this, over the largest, determine no coefficients.
SINGULAR = 1e-9


@dataclass(frozen=True)
class PredictedUncertainty:
    """U (k = 2) of the components of a corrected rate vector over a range, deg/s."""

    rms_dps: float  #: root mean square over the range
    worst_dps: float  #: largest at any place of the range
    worst_axis: str  #: the output where it is
    worst_temperature_c: float
    heat_rms_dps: float  #: the part of unsettled heat in the root mean square
    datasets: int
    coefficients: int  #: estimated in all outputs together


@single_threaded
def predicted_uncertainty(
    sets: PlannedSets,
    axes: tuple[str, ...],
    preset: Preset,
    noise: NoiseFigures,
    use: RangeOfUse,
    prior: CoefficientPrior | None = None,
) -> PredictedUncertainty:
    """Return what planned data sets will leave uncertain by a model. Raises NotEnoughData where they do not fit it.

    `prior` is what is known of the coefficients by other units of the type; fewer data sets then suffice.
    """
    data = planned_data(sets, axes, noise)
    model, rows = preset.build(data)
    kept = data.take(rows)
    if prior is None:
        require_enough_data(kept, model)
    else:
        model = prior.referred(model)
    points, weights = use.points
    variances, of_heat, coefficients = [], [], 0
    for axis in axes:
        design = axis_design(kept, model, axis, known=frozenset() if prior is None else prior.known(axis))
        jacobian = derivative_at_points(model, use, design, axis)
        known = None if prior is None else prior_rows(design, model, axis, prior)[0]
        by_noise, by_heat = _variances(kept, design, jacobian, sets.slope_k_s[rows], axis, noise, known)
        variances.append(by_noise + by_heat)
        of_heat.append(by_heat)
        coefficients += design.columns.shape[1]
    every = np.array(variances)
    row, place = divmod(int(np.argmax(every)), every.shape[1])
    temperatures_c = np.asarray(points["temperature_c"], dtype=np.float64)
    return PredictedUncertainty(
        K * float(np.sqrt(np.mean(every @ weights))), K * float(np.sqrt(every.max())), axes[row],
        float(temperatures_c[place]), K * float(np.sqrt(np.mean(np.array(of_heat) @ weights))), len(sets), coefficients,
    )  # fmt: skip


def derivative_at_points(model: ErrorModel, use: RangeOfUse, design: AxisDesign, axis: str) -> NDArray[np.float64]:
    """Return the derivative of the corrected rate by the estimated coefficients, (p, c).

    A unit in use has settled: what follows its temperature with a delay, and what is not exported, counts nothing.
    """
    points, _ = use.points
    terms = tuple(
        term for term in model.terms
        if is_exported(term) and not kind_of(term).remembers and not points.missing(kind_of(term).needs)
    )  # fmt: skip
    values = {
        (owner, column.name): column.values for owner, column in model.with_terms(terms).columns(points, axis)
    }  # fmt: skip
    basis = model.temperature.basis(points.temperature_c(axis))
    none = np.zeros(len(points))
    columns = [values.get((owner, name), none)[:, None] * basis for owner, name, _ in design.names]
    return np.asarray(np.concatenate(columns, axis=1) @ design.spread)


def _variances(
    data: FitData, design: AxisDesign, jacobian: NDArray[np.float64], slope_k_s: Array, axis: str, noise: NoiseFigures,
    known: NDArray[np.float64] | None,
) -> tuple[Array, Array]:  # fmt: skip
    """Return the variance at each point (p,) by noise and drift, and by unsettled heat, (deg/s)^2.

    `known` are whitened rows (q, c) of a prior.
    """
    figures, heat = noise.of(axis), noise.heat
    scatter = data.scatter(axis)
    assert scatter.white_var is not None
    size = np.linalg.norm(design.columns, axis=0)
    size = np.where(size > 0, size, 1.0)  # what only a prior knows has no column
    unsettled = heat.element_u_s * np.column_stack(
        [heat.bias_per_k * slope_k_s, heat.scale_per_k * slope_k_s * data.true_rate_dps(axis)]
    )
    c = design.columns.shape[1]
    values = np.concatenate([design.columns / size, unsettled], axis=1)
    whole, _ = whitened(scatter, figures.drifts, scatter.white_var, values)
    if known is not None:
        below = np.column_stack([known / size, np.zeros((len(known), unsettled.shape[1]))])
        whole = np.concatenate([whole, np.broadcast_to(below, (len(whole), *below.shape))], axis=1)
    by_noise, by_heat = np.zeros(len(jacobian)), np.zeros(len(jacobian))
    for rows in whole:
        q, r = np.linalg.qr(rows[:, :c])
        diagonal = np.abs(np.diag(r)) if len(r) == c else np.zeros(1)
        if diagonal.min() < SINGULAR * diagonal.max():
            raise NotEnoughData(
                "the planned data sets do not determine the coefficients of the model; plan more rates or temperatures"
            )
        reached = solve_triangular(r, (jacobian / size).T, trans="T", check_finite=False)
        by_noise += np.sum(reached**2, axis=0) / len(whole)
        by_heat += np.sum((reached.T @ (q.T @ rows[:, c:])) ** 2, axis=1) / len(whole)
    return by_noise, by_heat
