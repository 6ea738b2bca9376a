"""Ranking of the candidates by their evidence over all axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.plausibility import log_size_prior
from labctl.fitting.effects import CATALOGUE, Term
from labctl.fitting.numeric.arrays import Array

#: From this evidence on, nats, a candidate that has none at a physical size is listed as not physical.
UNPHYSICAL_FROM = 4.5


@dataclass(frozen=True)
class Candidate:
    """One candidate over all axes."""

    id: str
    smooth: bool
    log_bf: float  #: log Bayes factor against the base, with the prior of its size
    option: Mapping[str, int]  #: axis -> index of its option with the most evidence
    term: Term | None  #: the shape that fits all axes together best
    gain: float  #: chi2 that it removes, over all axes
    physical: bool = True  #: whether the size that it is fitted with is one that the unit's technology can have


def are_exact(*candidates: Candidate) -> bool:
    """Return whether each candidate is an effect whose parameters determine its shape."""
    kinds = [CATALOGUE.get(candidate.id) for candidate in candidates if not candidate.smooth]
    return len(kinds) == len(candidates) and all(kind is not None and kind.exact for kind in kinds)


def rank_candidates(
    designs: Mapping[str, Design], axes: Mapping[str, AxisEvidence], technology: str
) -> tuple[Candidate, ...]:
    """Return every candidate of the designs, the one with the most evidence first."""
    places = {axis: _places(design) for axis, design in designs.items()}
    priors = {axis: _size_priors(design, axes[axis], technology) for axis, design in designs.items()}
    found = []
    for key in dict.fromkeys(key for each in places.values() for key in each):
        which = {axis: each[key] for axis, each in places.items() if key in each}
        found.append(_physical_or_not(key, which, designs, axes, priors))
    return tuple(sorted((c for c in found if c is not None), key=lambda c: -c.log_bf))


def _places(design: Design) -> dict[tuple[str, bool], list[int]]:
    """Return (candidate, whether it is smooth) -> the indices of its options."""
    found: dict[tuple[str, bool], list[int]] = {}
    for index, option in enumerate(design.options):
        found.setdefault((option.candidate, option.smooth), []).append(index)
    return found


def _physical_or_not(
    key: tuple[str, bool], which: Mapping[str, list[int]], designs: Mapping[str, Design],
    axes: Mapping[str, AxisEvidence], priors: Mapping[str, Array],
) -> Candidate | None:  # fmt: skip
    """Return a candidate at its physical sizes; where these have no evidence, at those that it is fitted with."""
    physical = _candidate(key, which, designs, axes, priors)
    whatever = _candidate(key, which, designs, axes, None)
    if physical is None or whatever is None:
        return whatever
    return whatever if physical.log_bf <= 0 and whatever.log_bf > UNPHYSICAL_FROM else physical


def _size_priors(design: Design, found: AxisEvidence, technology: str) -> Array:
    """Return the log prior of the size of every option, (options,)."""
    return np.array([log_size_prior(option, found, i, technology) for i, option in enumerate(design.options)])


def _candidate(
    key: tuple[str, bool], which: Mapping[str, list[int]], designs: Mapping[str, Design],
    axes: Mapping[str, AxisEvidence], priors: Mapping[str, Array] | None,
) -> Candidate | None:  # fmt: skip
    """Return one candidate over all axes; None where no option of it has any direction beside the base.

    It may be on all axes, or on a single one: both are averaged over with equal prior probability. Options whose size
    is not physical are left out; without `priors` of the sizes they count, and the candidate is marked.
    """
    per_axis: list[float] = []
    best: dict[str, int] = {}
    terms: dict[tuple[object, ...], tuple[Term | None, float]] = {}
    gain = 0.0
    for axis, places in which.items():
        options, values = designs[axis].options, axes[axis].log_bf[places]
        tried = np.isfinite(values).sum()
        if priors is not None:
            values = values + priors[axis][places]
        if not np.any(np.isfinite(values)):
            continue
        per_axis.append(float(np.logaddexp.reduce(values) - np.log(tried)))
        best[axis] = places[int(np.argmax(values))]
        gain += float(axes[axis].gain[best[axis]])
        for i, value in zip(places, values.tolist(), strict=True):
            shape = _shape_of(options[i])
            terms[shape] = (options[i].term, terms.get(shape, (None, 0.0))[1] + value)
    if not per_axis:
        return None
    n = len(per_axis)
    joint = sum(per_axis)
    alternatives = [joint - np.log(2.0), *(value - np.log(2.0 * n) for value in per_axis)] if n > 1 else [joint]
    term = max(terms.values(), key=lambda pair: pair[1])[0]
    return Candidate(*key, float(np.logaddexp.reduce(alternatives)), best, term, gain, priors is not None)


def _shape_of(option: CandidateShape) -> tuple[object, ...]:
    term = option.term
    return () if term is None else (term.effect, term.order, *sorted(term.parameters.items()))
