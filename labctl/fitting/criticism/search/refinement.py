"""A candidate's nonlinear parameters, refined between the grid's neighbours (variable projection, Brent).

A grid is coarse: a shape between two of its points loses to a candidate with more freedom. So before a verdict that
names no effect, or several, the leaders are compared again in their best shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from labctl.fitting.criticism.candidates import option_of
from labctl.fitting.criticism.evidence.elimination import ScaledBase, WhitenedBase
from labctl.fitting.criticism.evidence.gains import gains_of
from labctl.fitting.criticism.model_comparison import Comparison, centred, compare_models, constant_coordinates
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.search.exact_shapes import exact_terms, stepped_terms
from labctl.fitting.criticism.search.steps import refined_steps
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.progress import report_stage

#: A parameter that is a choice between shapes, and no quantity, is not refined.
CHOICES = frozenset({
    "of_gradient", "bowed", "rounded", "low_c", "high_c", "by_sign", "by_position", "per_turn", "wobbles",
})  # fmt: skip
EVALUATIONS = 10
#: At most this many leaders are refined.
LEADERS = 5


def with_refined_leaders(comparison: Comparison, catalogue: Mapping[str, Effect], least: float) -> Comparison:
    """Return the comparison with its leaders (log evidence at least `least`), and a step in time, refined as well."""
    leaders = [c for c in comparison.candidates if not c.smooth and c.physical and c.log_bf >= least][:LEADERS]
    shapes = {c.id: refined_term(comparison, c) for c in leaders if c.term is not None}
    new = {c.id: shapes[c.id] for c in leaders if c.id in shapes and shapes[c.id] != c.term}
    steps = refined_steps(comparison)
    if not new and not steps:
        return comparison
    data, model = comparison.data, comparison.model
    designs = {}
    for axis, design in comparison.designs.items():
        options = (option_of(data, axis, model.reference, catalogue[name], term) for name, term in new.items())
        level = constant_coordinates(design.base, data)
        more = [centred(option, level) for option in (*options, steps.get(axis)) if option is not None]
        designs[axis] = replace(design, options=[*design.options, *more])
    return compare_models(data, model, catalogue, designs)


def refined_term(comparison: Comparison, candidate: Candidate) -> Term:
    """Return the candidate's best shape, each of its parameters refined in turn."""
    term, kind = candidate.term, CATALOGUE.get(candidate.id)
    assert term is not None
    if kind is None:
        return term
    if kind.exact:
        return stepped_terms(comparison, (*exact_terms(comparison.model.terms), term), candidate.option)[-1]
    for name in term.parameters:
        if name not in CHOICES:
            report_stage(f"refining the shape of {candidate.id}")
            term = _along(comparison, candidate, kind, term, name)
    return term


def _along(comparison: Comparison, candidate: Candidate, kind: Effect, term: Term, name: str) -> Term:
    axis = next(iter(candidate.option))
    options = [o.term for o in comparison.designs[axis].options if o.candidate == candidate.id and o.term is not None]
    grid = sorted({float(option.parameters[name]) for option in options if name in option.parameters})
    at = int(np.argmin(np.abs(np.log(np.array(grid) / term.parameters[name]))))
    low, high = np.log(grid[max(at - 1, 0)]), np.log(grid[min(at + 1, len(grid) - 1)])
    if not high > low:
        return term
    from scipy.optimize import minimize_scalar

    gain = _gain_function(comparison, candidate, kind)

    def with_value(logarithm: float) -> Term:
        return replace(term, parameters={**term.parameters, name: float(np.exp(logarithm))})

    optimum = minimize_scalar(
        lambda value: -gain(with_value(value)), bounds=(low, high), method="bounded", options={"maxiter": EVALUATIONS}
    )
    return with_value(float(optimum.x)) if -optimum.fun > gain(term) else term


def _gain_function(comparison: Comparison, candidate: Candidate, kind: Effect) -> Callable[[Term], float]:
    """Return the function shape -> chi2 that it removes over the candidate's axes, at the base's likeliest noise."""
    data, reference = comparison.data, comparison.model.reference
    bases = {
        axis: (
            WhitenedBase(comparison.designs[axis], comparison.white_var[axis], comparison.axes[axis].best.noise),
            ScaledBase(comparison.designs[axis], comparison.scales[axis]),
        )
        for axis in candidate.option
    }
    outputs = {axis: data.error_dps(axis) for axis in candidate.option}

    def gain(term: Term) -> float:
        total = 0.0
        for axis, (whitened, scaled) in bases.items():
            option = option_of(data, axis, reference, kind, term)
            if option is None:
                continue
            rows = np.concatenate([option.rows, outputs[axis][:, :, None]], axis=2)
            eliminated = whitened.eliminate_from(rows[0], scaled.products(rows))
            total += float(gains_of(eliminated, [slice(0, option.rows.shape[2])])[0][0])
        return total

    return gain
