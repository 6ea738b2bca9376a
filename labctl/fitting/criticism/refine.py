"""A candidate's nonlinear parameters, refined between the grid's neighbours (variable projection, Brent)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from labctl.fitting.criticism.evidence import gains_of, schur
from labctl.fitting.criticism.weigh import Candidate, Weighed
from labctl.fitting.effects import CATALOGUE, Effect, Term

#: A parameter that is a choice between shapes, and no quantity, is not refined.
CHOICES = frozenset({"of_gradient", "bowed", "by_sign", "by_position", "per_turn"})
EVALUATIONS = 10


def refined(weighed: Weighed, candidate: Candidate) -> Term:
    """Return the candidate's best shape, each of its parameters refined in turn."""
    term, kind = candidate.term, CATALOGUE.get(candidate.id)
    assert term is not None
    if kind is None:
        return term
    for name in term.parameters:
        if name not in CHOICES:
            term = _along(weighed, candidate, kind, term, name)
    return term


def _along(weighed: Weighed, candidate: Candidate, kind: Effect, term: Term, name: str) -> Term:
    axis = next(iter(candidate.option))
    options = [o.term for o in weighed.designs[axis].options if o.candidate == candidate.id and o.term is not None]
    grid = sorted({float(option.parameters[name]) for option in options})
    at = int(np.argmin(np.abs(np.log(np.array(grid) / term.parameters[name]))))
    low, high = np.log(grid[max(at - 1, 0)]), np.log(grid[min(at + 1, len(grid) - 1)])
    if not high > low:
        return term
    gain = gain_of(weighed, candidate, kind)

    def with_value(logarithm: float) -> Term:
        return replace(term, parameters={**term.parameters, name: float(np.exp(logarithm))})

    found = minimize_scalar(
        lambda value: -gain(with_value(value)), bounds=(low, high), method="bounded", options={"maxiter": EVALUATIONS}
    )
    return with_value(float(found.x)) if -found.fun > gain(term) else term


def gain_of(weighed: Weighed, candidate: Candidate, kind: Effect) -> Callable[[Term], float]:
    """Return how much chi2 a shape of an effect takes off, over the candidate's axes, at the base's likeliest noise."""
    data = weighed.data

    def gain(term: Term) -> float:
        total = 0.0
        for axis in candidate.option:
            columns = [c for c in kind.columns(data.nodes, axis, term, weighed.model.reference) if np.any(c.values)]
            if not columns:
                continue
            rows = np.stack([data.rows(column) for column in columns], axis=2)
            design, found = weighed.designs[axis], weighed.axes[axis]
            only = replace(design, options=[replace(design.options[0], rows=rows)])
            y = data.output[axis] - data.rows_of(data.nodes.rate_dps(axis)[:, None])[:, :, 0]
            left = schur(only, y, weighed.white_var[axis], weighed.scales[axis], [found.best.noise])[0]
            total += float(gains_of(left, [slice(0, rows.shape[2])])[0][0])
        return total

    return gain
