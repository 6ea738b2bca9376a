"""Ranking of the candidates by their evidence over all axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence
from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.log_evidence import mean_evidence, on_all_axes_or_one
from labctl.shown_unit import shown_unit

#: The size of a coefficient counts as its estimate less this many standard uncertainties.
SPARE_U = 2.0
#: A coefficient this many times its technology's span is not physical.
FARTHEST = 100.0
#: Largest physical coefficient by its unit, whatever the technology: an error of many times the rate itself is not
#: physical.
LARGEST = {"1": 3.0}
#: Evidence on an axis, nats, from which on the size on that axis counts.
SUPPORTED = 2.0


def log_size_prior(option: CandidateShape, axis_evidence: AxisEvidence, index: int, technology: str) -> float:
    """Return the log prior, nats <= 0, of the size that an option is fitted with; -inf where it is not physical.

    The prior is flat inside the span of plausible sizes of `technology` and falls as its inverse beyond; where the
    technology is not known, that of the largest sizes counts. The largest coefficient in the unit of the first is
    taken: an effect of three axes has one for each. A size that is not significant is plausible.
    """
    if option.term is None or option.term.effect not in CATALOGUE or axis_evidence.log_bf[index] < SUPPORTED:
        return 0.0
    values, covariance = solve_option(axis_evidence.best, axis_evidence.slices[index])
    least = np.maximum(np.abs(values) - SPARE_U * np.sqrt(np.maximum(np.diag(covariance), 0.0)), 0.0)
    if _is_beyond_all(option, least) or _has_wrong_sign(option, float(values[0]), float(least[0]), technology):
        return -np.inf
    size = float(max(s for s, unit_symbol in zip(least, option.units, strict=True) if unit_symbol == option.units[0]))
    largest = largest_plausible(option.term.effect, technology)
    if largest is None or not size > 0:
        return 0.0
    if size > FARTHEST * largest:
        return -np.inf
    return -float(np.log(max(size / largest, 1.0)))


def largest_plausible(effect_id: str, technology: str) -> float | None:
    """Return the largest plausible first coefficient of an effect, in its unit; None where no range is known.

    Of an unknown `technology` ("") the largest of all.
    """
    return max((max(abs(low), abs(high)) for low, high in _spans(CATALOGUE[effect_id], technology)), default=None)


def _spans(kind: Effect, technology: str) -> list[tuple[float, float]]:
    """Return the spans of plausible sizes: of a technology, of an unknown one ("") those of all."""
    if technology in kind.ranges:
        return [kind.ranges[technology]]
    return [] if technology else list(kind.ranges.values())


def largest_physical(effect_id: str, unit_symbol: str, technology: str) -> float:
    """Return the largest first coefficient that an effect can have at all, in its unit; infinity where none is known.

    Of a part of a whole (`labctl.shown_unit.PARTS`) it is the whole, 1; of others what a criticism takes for physical.
    """
    if unit_symbol == "1" and shown_unit(unit_symbol, effect_id).unit == "%":
        return 1.0
    largest = largest_plausible(effect_id, technology)
    return min(LARGEST.get(unit_symbol, np.inf), np.inf if largest is None else FARTHEST * largest)


def _has_wrong_sign(option: CandidateShape, value: float, least: float, technology: str) -> bool:
    """Return whether a coefficient is clearly of a sign that its effect cannot have: more output beyond a knee."""
    kind = CATALOGUE[option.term.effect] if option.term is not None else None
    if kind is None or not kind.one_sign or not least > 0:
        return False
    spans = _spans(kind, technology)
    return bool(spans) and all((value < 0 <= low) or (value > 0 >= high) for low, high in spans)


def _is_beyond_all(option: CandidateShape, least: Array) -> bool:
    return any(size > LARGEST.get(unit_symbol, np.inf) for size, unit_symbol in zip(least, option.units, strict=True))


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
    size_nats: float = 0.0  #: what `log_bf` gains where its size is averaged over as that of draws is


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
    ranked = []
    for key in dict.fromkeys(key for place in places.values() for key in place):
        which = {axis: place[key] for axis, place in places.items() if key in place}
        ranked.append(_physical_or_not(key, which, designs, axes, priors))
    return tuple(sorted((c for c in ranked if c is not None), key=lambda c: -c.log_bf))


def _places(design: Design) -> dict[tuple[str, bool], list[int]]:
    """Return (candidate, whether it is smooth) -> the indices of its options."""
    places_by_term: dict[tuple[str, bool], list[int]] = {}
    for index, option in enumerate(design.options):
        places_by_term.setdefault((option.candidate, option.smooth), []).append(index)
    return places_by_term


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


def _size_priors(design: Design, axis_evidence: AxisEvidence, technology: str) -> Array:
    """Return the log prior of the size of every option, (options,)."""
    return np.array([log_size_prior(option, axis_evidence, i, technology) for i, option in enumerate(design.options)])


def _candidate(
    key: tuple[str, bool], which: Mapping[str, list[int]], designs: Mapping[str, Design],
    axes: Mapping[str, AxisEvidence], priors: Mapping[str, Array] | None,
) -> Candidate | None:  # fmt: skip
    """Return one candidate over all axes; None where no option of it has any direction beside the base.

    It may be on all axes, or on a single one: both are averaged over with equal prior probability. Options whose size
    is not physical are left out; without `priors` of the sizes they count, and the candidate is marked.
    """
    per_axis: list[float] = []
    of_sizes: list[float] = []
    best: dict[str, int] = {}
    terms: dict[tuple[object, ...], tuple[Term | None, float]] = {}
    gain = 0.0
    for axis, places in which.items():
        options, values = designs[axis].options, axes[axis].log_bf[places]
        tried = int(np.isfinite(values).sum())
        if priors is not None:
            values = values + priors[axis][places]
        if not np.any(np.isfinite(values)):
            continue
        per_axis.append(float(mean_evidence(values, tried)))
        of_sizes.append(float(mean_evidence(values + axes[axis].size_nats[places], tried)))
        best[axis] = places[int(np.argmax(values))]
        gain += float(axes[axis].gain[best[axis]])
        for i, value in zip(places, values.tolist(), strict=True):
            shape = _shape_of(options[i])
            terms[shape] = (options[i].term, terms.get(shape, (None, 0.0))[1] + value)
    if not per_axis:
        return None
    term = max(terms.values(), key=lambda pair: pair[1])[0]
    log_bf, by_sizes = float(on_all_axes_or_one(per_axis)), float(on_all_axes_or_one(of_sizes))
    return Candidate(*key, log_bf, best, term, gain, priors is not None, by_sizes - log_bf)


def _shape_of(option: CandidateShape) -> tuple[object, ...]:
    term = option.term
    return () if term is None else (term.effect, term.order, *sorted(term.parameters.items()))
