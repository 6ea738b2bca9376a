"""A candidate's nonlinear parameters, refined between the grid's neighbours (variable projection, Brent).

A grid is coarse: a shape that falls between two of its points loses to whatever bends more freely. So before an answer
that names nothing, or several, the leaders are weighed again in their best shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.evidence import Base, gains_of, non_mean_products
from labctl.fitting.criticism.model_comparison import Candidate, Comparison, centred, compare_models, level_of
from labctl.fitting.effects import CATALOGUE, Effect, Term

#: A parameter that is a choice between shapes, and no quantity, is not refined.
CHOICES = frozenset({"of_gradient", "bowed", "by_sign", "by_position", "per_turn"})
EVALUATIONS = 10
#: How many leaders are weighed again.
LEADERS = 5


def sharpened(weighed: Comparison, catalogue: Mapping[str, Effect], least: float) -> Comparison:
    """Return everything weighed again with the leaders (log evidence at least `least`) in their refined shapes too."""
    leaders = [c for c in weighed.candidates if not c.smooth and c.log_bf >= least][:LEADERS]
    shapes = {c.id: refined(weighed, c) for c in leaders if c.term is not None}
    new = {c.id: shapes[c.id] for c in leaders if c.id in shapes and shapes[c.id] != c.term}
    if not new:
        return weighed
    data, model = weighed.data, weighed.model
    designs = {}
    for axis, design in weighed.designs.items():
        made = (option_of(data, axis, model.reference, catalogue[name], term) for name, term in new.items())
        level = level_of(design.base, data)
        more = [centred(option, level) for option in made if option is not None]
        designs[axis] = replace(design, options=[*design.options, *more])
    return compare_models(data, model, catalogue, designs)


def refined(weighed: Comparison, candidate: Candidate) -> Term:
    """Return the candidate's best shape, each of its parameters refined in turn."""
    term, kind = candidate.term, CATALOGUE.get(candidate.id)
    assert term is not None
    if kind is None:
        return term
    for name in term.parameters:
        if name not in CHOICES:
            term = _along(weighed, candidate, kind, term, name)
    return term


def _along(weighed: Comparison, candidate: Candidate, kind: Effect, term: Term, name: str) -> Term:
    axis = next(iter(candidate.option))
    options = [o.term for o in weighed.designs[axis].options if o.candidate == candidate.id and o.term is not None]
    grid = sorted({float(option.parameters[name]) for option in options if name in option.parameters})
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


def gain_of(weighed: Comparison, candidate: Candidate, kind: Effect) -> Callable[[Term], float]:
    """Return how much chi2 a shape of an effect takes off, over the candidate's axes, at the base's likeliest noise."""
    data, reference = weighed.data, weighed.model.reference
    bases = {
        axis: Base(weighed.designs[axis], weighed.white_var[axis], weighed.axes[axis].best.noise)
        for axis in candidate.option
    }
    outputs = {
        axis: data.output[axis] - data.rows_of(data.nodes.rate_dps(axis)[:, None])[:, :, 0] for axis in candidate.option
    }

    def gain(term: Term) -> float:
        total = 0.0
        for axis, base in bases.items():
            option = option_of(data, axis, reference, kind, term)
            if option is None:
                continue
            rows = np.concatenate([option.rows, outputs[axis][:, :, None]], axis=2)
            others = non_mean_products(weighed.designs[axis], rows, weighed.scales[axis])
            left = base.taken_out_of(rows[0], others)
            total += float(gains_of(left, [slice(0, option.rows.shape[2])])[0][0])
        return total

    return gain
