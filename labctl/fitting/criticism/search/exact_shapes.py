"""Parameters of effects whose shape they determine alone, by Gauss-Newton steps beside the base, as in a fit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from labctl.fitting.criticism.base_columns import base_of
from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.effects.response import response_of_terms
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.numeric.arrays import Array

#: Steps, and the change, as a share of the parameters, at which they end.
STEPS, CLOSE = 15, 1e-6
#: Least value of a parameter, in its unit, and the share of it that one step leaves.
LEAST, MIN_REMAINING = 1e-6, 0.25


def exact_terms(terms: Iterable[Term]) -> tuple[Term, ...]:
    """Return the terms whose parameter determines the shape."""
    return tuple(term for term in terms if kind_of(term).exact and term.parameters)


def stepped_terms(comparison: Comparison, terms: tuple[Term, ...], axes: Iterable[str]) -> tuple[Term, ...]:
    """Return exact terms with the parameters that fit best together, each the mean over the axes.

    At each step the rest of the model sees the rate that comes through them, so that the size of the rest, a scale
    factor of some per cent, does not enter their parameters.
    """
    chosen = list(axes)
    smooth_model = comparison.model.with_terms(
        tuple(term for term in comparison.model.terms if term not in exact_terms(comparison.model.terms))
    )
    for _ in range(STEPS):
        data = comparison.data.through(response_of_terms(terms))
        steps = np.mean([_steps(comparison, data, smooth_model, axis, terms) for axis in chosen], axis=0)
        before = np.array([next(iter(term.parameters.values())) for term in terms])
        after = np.maximum(before + steps, np.maximum(MIN_REMAINING * before, LEAST))
        terms = tuple(
            replace(term, parameters={next(iter(term.parameters)): value})
            for term, value in zip(terms, after.tolist(), strict=True)
        )
        if np.all(np.abs(after - before) <= CLOSE * before):
            break
    return terms


def with_exact_terms(comparison: Comparison, terms: tuple[Term, ...]) -> tuple[Term, ...]:
    """Return terms, in their order, of which several exact ones have the parameters that fit best together."""
    if len(exact := exact_terms(terms)) < 2:
        return terms
    shapes = {term.effect: term for term in stepped_terms(comparison, exact, comparison.axes)}
    return tuple(shapes.get(term.effect, term) for term in terms)


def _steps(
    comparison: Comparison, data: ReducedRecording, base_model: ErrorModel, axis: str, terms: tuple[Term, ...]
) -> Array:
    """Return by how much each parameter should change on one axis, by weighted least squares beside the rest."""
    options = [option_of(data, axis, base_model.reference, kind_of(term), term) for term in terms]
    tangents = [option.rows for option in options if option is not None]
    if len(tangents) < len(terms):
        return np.zeros(len(terms))
    base, _ = base_of(data, base_model, axis)
    scale = comparison.scales[axis].copy()
    scale[0] = np.sqrt(comparison.white_var[axis] + comparison.axes[axis].best.noise.size_dps ** 2)
    present = comparison.designs[axis].present
    columns = np.concatenate([base, *tangents], axis=2)[present] / scale[present][:, None]
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    solution, *_ = np.linalg.lstsq(columns / size, data.error_dps(axis)[present] / scale[present], rcond=1e-10)
    return np.asarray((solution / size)[base.shape[2] :])
