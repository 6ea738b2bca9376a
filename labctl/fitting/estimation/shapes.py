"""Shapes of the effects that remember: time constants and widths, found together by variable projection.

A lag's time constant and a hysteresis' width enter a model nonlinearly. For given shapes the coefficients are a
weighted least-squares fit; the shapes are those that leave the least, at the noise that the recording shows beside its
rich surface. Where a model has several, each is found beside the others: alone, a hysteresis takes part of a lag. How
many time constants a lag has is chosen by stretches of the temperature course that are left out (`thermal_response`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import Effect, Parameter, Span, Term, kind_of
from labctl.fitting.estimation.axis_design import axis_design
from labctl.fitting.estimation.thermal_flows import STRUCTURES
from labctl.fitting.estimation.thermal_response import lags_of, thermal_response
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import Preset, Rows
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_whitening import whitened

#: Shapes are found to this share, in at most so many evaluations for each.
TOLERANCE, EVALUATIONS = 0.005, 60


def quantities(kind: Effect) -> list[Parameter]:
    """Return the parameters that are found from the data: of an effect of the bias, and of one that remembers."""
    return (
        [parameter for parameter in kind.parameters if parameter.logarithmic]
        if kind.shows_at_rest or kind.remembers
        else []
    )


def with_shapes(data: FitData, preset: Preset, *, all_of_them: bool = False) -> Preset:
    """Return a preset whose effects that remember have the shapes that fit the data best.

    A shape that a term states already is kept, unless `all_of_them` is given and several effects remember. Raises
    NotEnoughData where the preset cannot be built.
    """
    model, _ = preset.build(data)
    remembering = [term for term in model.terms if quantities(kind_of(term))]
    open_ = [term for term in remembering if not kind_of(term).states_shape(term)]
    again = all_of_them and (len(remembering) > 1 or bool(lags_of(model)))
    if not (open_ or again):
        return preset
    if any(data.channels.missing(kind_of(term).channels) for term in remembering):
        return preset  # the fit says what is missing
    effects = [term.effect for term in (remembering if all_of_them else open_)]
    shapes = {t.effect: t for t in _with_structure(data, model, _found(data, model, effects))}
    if not shapes:
        return preset

    def build(some: FitData) -> tuple[ErrorModel, Rows]:
        built, rows = preset.build(some)
        terms = (replace(t, parameters=shapes[t.effect].parameters) if t.effect in shapes else t for t in built.terms)
        return built.with_terms(tuple(terms)), rows

    return Preset(preset.name, build, preset.inner_only)


def _with_structure(data: FitData, model: ErrorModel, thermal_terms: Sequence[Term]) -> Sequence[Term]:
    """Return terms in their best shapes with the heat flows of the lags among them that the recording shows."""
    shaped = {term.effect: term for term in thermal_terms}
    lags = [lag.effect for lag in lags_of(model) if lag.effect in shaped and lag.effect not in model.held.effects]
    flows: list[str] = []
    for effect in lags:
        model = model.with_terms(tuple(shaped.get(term.effect, term) for term in model.terms))
        response = thermal_response(data, model, shaped[effect])
        if response is not None and response.structure is not STRUCTURES[0]:
            shaped[effect] = response.term
            flows.append(effect)
    others = [effect for effect in shaped if effect not in flows]
    if flows and others:  # beside another lag they have other shapes
        model = model.with_terms(tuple(shaped.get(term.effect, term) for term in model.terms))
        shaped |= {term.effect: term for term in _found(data, model, others)}
    return list(shaped.values())


@single_threaded
def _found(data: FitData, model: ErrorModel, effects: Sequence[str]) -> list[Term]:
    """Return the terms of these effects in their best shapes."""
    search = _Search(data, model)
    terms = {term.effect: term for term in model.terms}
    for name in effects:
        if not terms[name].parameters:
            options = kind_of(terms[name]).options(Span(1.0, 0.1, (0.0,), frozenset(data.channels.columns)))
            shaped = [replace(terms[name], parameters=option.parameters) for option in options]
            terms[name] = min(shaped, key=lambda term: search.left({**terms, name: term}))
    free = [(name, p) for name in effects for p in quantities(kind_of(terms[name])) if p.name in terms[name].parameters]
    if not free:
        return [terms[name] for name in effects]

    def at(logarithms: Array) -> dict[str, Term]:
        shaped = dict(terms)
        for (name, parameter), value in zip(free, logarithms.tolist(), strict=True):
            shaped[name] = replace(
                shaped[name], parameters={**shaped[name].parameters, parameter.name: float(np.exp(value))}
            )
        return shaped

    from scipy.optimize import minimize

    begin = np.log([terms[name].parameters[p.name] for name, p in free])
    bounds = [(float(np.log(p.low)), float(np.log(p.high))) for _, p in free]
    best = minimize(
        lambda x: search.left(at(x)), np.clip(begin, *np.array(bounds).T), method="Nelder-Mead", bounds=bounds,
        options={"xatol": TOLERANCE, "fatol": 0.01, "maxfev": EVALUATIONS * len(free)},
    )  # fmt: skip
    terms_found = at(np.asarray(best.x)) if best.fun < search.left(terms) else terms
    return [terms_found[name] for name in effects]


@dataclass(frozen=True)
class _Search:
    """What shapes of a model leave of the data, at the drift of the recording's noise floor."""

    data: FitData
    model: ErrorModel

    def left(self, terms: dict[str, Term]) -> float:
        """Return the weighted sum of squares that a model with these terms leaves, over all axes."""
        model = self.model.with_terms(tuple(terms[term.effect] for term in self.model.terms))
        total = 0.0
        for axis in self.data.outputs:
            design = axis_design(self.data, model, axis)
            scatter = self.data.scatter(axis)
            white = scatter.white_var if scatter.white_var is not None else np.ones(len(self.data))
            y = self.data.outputs[axis] - self.data.true_rate_dps(axis) - design.offset_dps
            drift = self.data.noise_floor.axes[axis].drift
            rows = whitened(scatter, [drift], white, np.column_stack([design.columns, y]))[0][0]
            size = np.maximum(np.linalg.norm(rows[:, :-1], axis=0), 1e-300)
            coordinates, *_ = np.linalg.lstsq(rows[:, :-1] / size, rows[:, -1], rcond=1e-9)
            total += float(np.sum((rows[:, -1] - rows[:, :-1] / size @ coordinates) ** 2))
        return total
