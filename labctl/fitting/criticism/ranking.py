"""Ranking of the candidates by their evidence over all axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.effects import Term


@dataclass(frozen=True)
class Candidate:
    """One candidate over all axes."""

    id: str
    smooth: bool
    log_bf: float  #: log Bayes factor against the base
    option: Mapping[str, int]  #: axis -> index of its option with the most evidence
    term: Term | None  #: the shape that fits all axes together best
    gain: float  #: chi2 that it removes, over all axes


def rank_candidates(designs: Mapping[str, Design], axes: Mapping[str, AxisEvidence]) -> tuple[Candidate, ...]:
    """Return every candidate of the designs, the one with the most evidence first."""
    names: dict[tuple[str, bool], None] = {}
    for design in designs.values():
        for option in design.options:
            names[option.candidate, option.smooth] = None
    found = [_candidate(name, smooth, designs, axes) for name, smooth in names]
    return tuple(sorted((c for c in found if c is not None), key=lambda c: -c.log_bf))


def _candidate(
    name: str, smooth: bool, designs: Mapping[str, Design], axes: Mapping[str, AxisEvidence]
) -> Candidate | None:
    """Return one candidate over all axes; None where no option of it has any direction beside the base.

    It may be on all axes, or on a single one: both are averaged over with equal prior probability.
    """
    per_axis: list[float] = []
    best: dict[str, int] = {}
    terms: dict[tuple[object, ...], tuple[Term | None, float]] = {}
    gain = 0.0
    for axis, design in designs.items():
        which = [i for i, o in enumerate(design.options) if (o.candidate, o.smooth) == (name, smooth)]
        values = axes[axis].log_bf[which] if which else np.zeros(0)
        if not len(values) or not np.any(np.isfinite(values)):
            continue
        per_axis.append(float(logsumexp(values) - np.log(np.isfinite(values).sum())))
        best[axis] = which[int(np.argmax(values))]
        gain += float(axes[axis].gain[best[axis]])
        for i, value in zip(which, values, strict=True):
            key = _key(design.options[i])
            terms[key] = (design.options[i].term, terms.get(key, (None, 0.0))[1] + float(value))
    if not per_axis:
        return None
    n = len(per_axis)
    joint = sum(per_axis)
    alternatives = [joint - np.log(2.0), *(value - np.log(2.0 * n) for value in per_axis)] if n > 1 else [joint]
    term = max(terms.values(), key=lambda pair: pair[1])[0]
    return Candidate(name, smooth, float(logsumexp(alternatives)), best, term, gain)


def _key(option: CandidateShape) -> tuple[object, ...]:
    term = option.term
    return () if term is None else (term.effect, term.order, *sorted(term.parameters.items()))
