"""Standard uncertainties of time constants and widths: how much of the data each of them moves, beside all else.

To first order about the fit (Gauss and Newton's), at the noise that the fit found. The coefficients are free meanwhile.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.fitted_model import Coefficient
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_whitening import whitened
from labctl.fitting.numeric.least_squares import Solution

#: Step of a parameter, in its logarithm.
STEP = 0.02
#: A time constant that the data do not move by more than this share of the noise has no uncertainty.
LEAST = 1e-12


@dataclass(frozen=True)
class _Moved:
    term: Term
    name: str
    unit: str


def shapes_of(
    data: FitData, fitted: FittedModel, solutions: Mapping[str, Solution]
) -> dict[str, dict[str, Coefficient]]:
    """Return effect -> name -> value, u and unit of each quantity in the shape of an effect that remembers.

    `u` is None where the data do not determine it.
    """
    moved = [
        _Moved(term, name, "s" if name.endswith("_s") else "K")
        for term in fitted.model.terms
        if kind_of(term).remembers
        for name in term.parameters
        if name.endswith("_s") or name == "width_k"
    ]
    if not moved:
        return {}
    information = np.zeros((len(moved), len(moved)))
    for axis in data.outputs:
        rows = _beside_base(data, fitted, axis, solutions[axis], np.column_stack(
            [_slope_dps(data, fitted, axis, each) for each in moved]
        ))  # fmt: skip
        information += rows.T @ rows
    u_log = _u(information)
    by_axis: dict[str, dict[str, Coefficient]] = {}
    for each, u in zip(moved, u_log.tolist(), strict=True):
        value = each.term.parameters[each.name]
        by_axis.setdefault(each.term.effect, {})[each.name] = {
            "value": value, "u": value * u if np.isfinite(u) else None, "unit": each.unit,
        }  # fmt: skip
    return by_axis


def _slope_dps(data: FitData, fitted: FittedModel, axis: str, moved: _Moved) -> Array:
    """Return what the logarithm of a parameter moves of an axis's error, (m,) deg/s."""
    ends = []
    for sign in (1.0, -1.0):
        value = moved.term.parameters[moved.name] * float(np.exp(sign * STEP))
        term = replace(moved.term, parameters={**moved.term.parameters, moved.name: value})
        terms = tuple(term if own_term is moved.term else own_term for own_term in fitted.model.terms)
        model = FittedModel(fitted.model.with_terms(terms), fitted.axes)
        ends.append(model.error_dps(data.seen_by(fitted.model.argument), axis))
    return np.asarray((ends[0] - ends[1]) / (2 * STEP))


def _beside_base(
    data: FitData, fitted: FittedModel, axis: str, solution: Solution, slopes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return columns (m, k) over the noise, without what the coefficients of the model take of them."""
    base = axis_design(data, fitted.model, axis).columns
    scatter = data.scatter(axis)
    white = scatter.white_var if scatter.white_var is not None else np.ones(len(data))
    rows = whitened(scatter, [solution.noise.drift_beside(scatter)], white, np.column_stack([base, slopes]))[0][0]
    base_columns, moved = rows[:, : base.shape[1]], rows[:, base.shape[1] :]
    size = np.maximum(np.linalg.norm(base_columns, axis=0), 1e-300)
    coordinates, *_ = np.linalg.lstsq(base_columns / size, moved, rcond=1e-9)
    residual = moved - base_columns / size @ coordinates
    noise = float(np.sqrt(solution.scale)) if np.isfinite(solution.scale) else np.inf
    return np.asarray(residual / max(noise, 1e-300))


def _u(information: NDArray[np.float64]) -> Array:
    """Return standard uncertainties from an information matrix (k, k); infinite where it has none."""
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    is_seen = size > LEAST
    u = np.full(len(size), np.inf)
    if is_seen.any():
        scaled = information[np.ix_(is_seen, is_seen)] / np.outer(size[is_seen], size[is_seen])
        u[is_seen] = np.sqrt(np.maximum(np.diag(np.linalg.pinv(scaled, rcond=1e-10)), 0.0)) / size[is_seen]
    return u
