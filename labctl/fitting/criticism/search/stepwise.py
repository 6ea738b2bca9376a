"""Stepwise search: the effect that is named is added to the model and all is compared again, until none is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.channel_functions import smooth_channels
from labctl.fitting.criticism.evidence.design import Discrepancy
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.criticism.model_comparison import Comparison, compare_beside, on_axis
from labctl.fitting.criticism.ranking import Candidate, are_exact
from labctl.fitting.criticism.rivals import ALIKE, FAR, LEAD
from labctl.fitting.criticism.search.discrepancy import discrepancies, drivers, together
from labctl.fitting.criticism.search.exact_shapes import with_exact_terms
from labctl.fitting.criticism.search.free_shapes import beside_terms, channels_beside_smooth, channels_of_free_shape
from labctl.fitting.criticism.search.held_out import held_out_rises
from labctl.fitting.criticism.search.refinement import refined_term, with_refined_leaders
from labctl.fitting.criticism.search.remainder import is_better_than_smooth, is_within_noise, remainder_of
from labctl.fitting.criticism.search.steps import may_be_step
from labctl.fitting.criticism.verdict import (
    ENOUGH,
    Form,
    Step,
    Verdict,
    alias_group,
    axes_of,
    channels_behind,
    confounded_with,
    is_at_end,
    is_of_another_law,
    judge,
    not_physical_group,
    overlap,
)
from labctl.fitting.effects import CATALOGUE, Effect, Term

#: The next effect is only named when its evidence, where it does most, is at least this share of the evidence for the
#: one before: less is the residue of a wrong shape of the one before.
NEXT_SHARE = 0.04
#: The same after effects that could not be distinguished: one of the others may fit better than the one that was added.
NEXT_SHARE_AMBIGUOUS = 0.08
#: Least share of an effect that is assumed within data sets, and between them.
MIN_PART = 0.05


def is_shape_error(before: Comparison, named_step: Step, after: Comparison, step: Step) -> bool:
    """Return whether the new leader may be the residue of a wrong shape of the effect that was just added.

    The two are compared where the new leader is largest, within data sets or between them: the wrong shape of a wave
    within data sets leaves waves, and hardly anything between them. Beside an effect of the temperature, another one
    of which the shortest time constant fits best is the delay of the first.
    """
    if step.leader is None or named_step.leader is None or are_exact(step.leader, named_step.leader):
        return False
    both = all(
        leader.id in CATALOGUE and CATALOGUE[leader.id].by_temperature for leader in (named_step.leader, step.leader)
    )
    if both and is_at_end(after, step.leader, shortest=True):
        return True
    least = NEXT_SHARE if _are_one(before, named_step) else NEXT_SHARE_AMBIGUOUS
    of_new, of_old = _within_and_between(after, step.leader), _within_and_between(before, named_step.leader)
    largest = int(np.argmax(of_new))
    could = max(float(of_old[largest]), MIN_PART) * named_step.leader.log_bf
    return bool(of_new[largest] * step.leader.log_bf < least * could)


def _are_one(comparison: Comparison, named_step: Step) -> bool:
    """Return whether a group is one effect, or several that each reproduce the leader's signal."""
    other_candidates = [c for c in comparison.candidates if not c.smooth and c.id in named_step.group[1:]]
    return (
        all(overlap(comparison, named_step.leader, other) > ALIKE for other in other_candidates)
        if named_step.leader
        else False
    )


def _within_and_between(comparison: Comparison, candidate: Candidate) -> NDArray[np.float64]:
    """Return the shares of a candidate's signal beside the base that lie within data sets, and between them."""
    total = np.zeros(2)
    for axis, index in candidate.option.items():
        design, axis_comparison = comparison.designs[axis], comparison.axes[axis]
        values, _ = solve_option(axis_comparison.best, axis_comparison.slices[index])
        scale = comparison.scales[axis].copy()
        scale[0] = np.sqrt(comparison.white_var[axis] + axis_comparison.best.noise.size_dps**2)
        present = design.present
        base, signal = (rows[present] / scale[present][:, None] for rows in (design.base, design.options[index].rows))
        size = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
        coordinates, *_ = np.linalg.lstsq(base / size, signal @ values, rcond=1e-9)
        residual = np.zeros(present.shape)
        residual[present] = signal @ values - base / size @ coordinates
        total += (np.sum(residual[1:] ** 2), np.sum(residual[0] ** 2))
    return np.asarray(total / max(float(total.sum()), 1e-300))


def merged(apart: Mapping[str, Verdict], joint: Verdict) -> Verdict:
    """Return the verdict of the axes, each with causes of its own; the joint one where an axis stays unexplained."""
    if any(verdict.form == "unexplained" for verdict in apart.values()):
        return joint
    axes: dict[tuple[str, ...], tuple[str, ...]] = {}
    for axis, verdict in apart.items():
        for group in verdict.groups:
            same = next((same_axis for same_axis in axes if same_axis[0] == group[0]), group)
            axes[same] = (*axes.get(same, ()), axis)
    if not axes:
        return joint
    terms = {name: term for verdict in apart.values() for name, term in verdict.terms.items()}
    remainders = [verdict.remainder for verdict in apart.values() if verdict.remainder is not None]
    return Verdict(
        "missing" if all(len(group) == 1 for group in axes) else "ambiguous", tuple(axes), joint.depends_on,
        terms={group[0]: terms[group[0]] for group in axes if group[0] in terms},
        remainder=max(remainders, key=lambda remainder: float(remainder["share"]), default=None),
        axes={group[0]: group_axes for group, group_axes in axes.items()},
    )  # fmt: skip


#: How many effects may be found missing one after the other.
STEPS = 4
#: From this evidence on, an effect is worth refining its shape.
NOTICED = 1.0
#: How many of the strongest are tried as the first of a pair.
LEADERS = 4
#: Where what is named leaves more than this share of the excess, it is not the cause.
MAX_REMAINING = 0.5
#: An effect whose shape may be wrong by a few per cent explains at least this share of what a smooth function does.
MOSTLY = 0.8


@dataclass(frozen=True)
class Finding:
    """An effect found missing: the leader in its best shape, and the effects that cannot be distinguished from it."""

    group: tuple[str, ...]  #: ids, the leader first
    term: Term
    log_bf: float
    discrepancy: Mapping[str, Discrepancy] = field(default_factory=dict)  #: by axis
    axes: tuple[str, ...] = ()  #: that show it


def search_stepwise(first: Comparison, catalogue: Mapping[str, Effect]) -> tuple[Verdict, Comparison, Comparison]:
    """Return the verdict, the first comparison with its leaders' shapes refined, and the last step's comparison.

    Where nothing is found over all axes together, each axis is searched by itself: they may have different causes.
    """
    verdict, initial, final = _searched(first, catalogue)
    if verdict.form != "adequate" and _is_weak(initial, verdict) and is_within_noise(first):
        return Verdict("adequate", further=verdict.groups), initial, initial
    if verdict.form == "unexplained" and len(first.axes) > 1:
        apart = {axis: _searched(on_axis(first, axis), catalogue)[0] for axis in first.axes}
        return merged(apart, verdict), initial, final
    return verdict, initial, final


def _is_weak(initial: Comparison, verdict: Verdict) -> bool:
    """Return whether the evidence for what is named could still be noise, should the noise be other than estimated.

    Where nothing is named, that is the evidence for anything at all.
    """
    named = [c for c in initial.candidates if c.id in verdict.named and not c.smooth]
    return all(c.log_bf < FAR for c in named or initial.candidates)


def _searched(first: Comparison, catalogue: Mapping[str, Effect]) -> tuple[Verdict, Comparison, Comparison]:
    initial, step = _judged(first, catalogue)
    depends = channels_behind(initial)
    if step.form == "unexplained":
        step = _explained_but_for_shape(first, initial, step)
    if step.form == "unexplained":
        findings, final = _pair(first, initial, catalogue), initial
        form: Form = _form(findings) if findings else step.form
    else:
        findings, final = _one_by_one(first, initial, step, catalogue)
        form = _form(findings) if len(findings) > 1 else step.form
    if not findings and form in {"missing", "ambiguous"}:  # what would be named predicts worse than nothing
        findings = _pair(first, initial, catalogue)  # a single effect may: two of opposite signs hide each other
        if findings and held_out_rises(first, tuple(finding.term for finding in findings), catalogue):
            findings = []
        form = _form(findings) if findings else "unexplained"
    depends = depends or step.depends_on or _driver_of(initial, step)
    with_findings = with_exact_terms(first, tuple(finding.term for finding in findings))
    if findings:
        wrong_by = together([finding.discrepancy for finding in findings])
        beside = beside_terms(first, with_findings, wrong_by) if final is initial else final  # a pair is not in `final`
        if channels := channels_of_free_shape(first, beside, with_findings, catalogue):
            return _unnamed(initial, (*channels, *(name for name in depends if name not in channels)))
    remainder = remainder_of(first, final, with_findings, catalogue) if findings else None
    if remainder is not None and remainder["share"] > MAX_REMAINING:
        return _unnamed(initial, tuple(remainder["depends_on"]))
    terms = {term.effect: term for term in with_findings}
    channel_names = depends if findings or form == "unexplained" else ()
    groups = tuple(finding.group for finding in findings)
    alike = not_physical_group(initial, step.leader) if step.leader is not None and findings else ()
    confounded = _confounded(initial, channel_names) if form == "unexplained" else ()
    if form == "unexplained":
        also = (*confounded, *channels_beside_smooth(first, catalogue))
        confounded = tuple(dict.fromkeys(name for name in also if name not in channel_names[:1]))
    verdict = Verdict(
        form, groups, channel_names, terms=terms, confounded=confounded, not_physical=alike, remainder=remainder,
        axes={finding.group[0]: finding.axes for finding in findings},
    )  # fmt: skip
    return verdict, initial, final


def _unnamed(initial: Comparison, channels: tuple[str, ...]) -> tuple[Verdict, Comparison, Comparison]:
    """Return the verdict that names no effect, for what is better described without one."""
    return Verdict("unexplained", (), channels, confounded=_confounded(initial, channels)), initial, initial


def _confounded(comparison: Comparison, channels: tuple[str, ...]) -> tuple[str, ...]:
    return confounded_with(comparison, channels[0]) if channels else ()


def _form(findings: Sequence[Finding]) -> Form:
    return "missing" if all(len(finding.group) == 1 for finding in findings) else "ambiguous"


def _driver_of(comparison: Comparison, step: Step) -> tuple[str, ...]:
    """Return the channel that drives the leader of a step."""
    kind = CATALOGUE.get(step.leader.id) if step.leader is not None else None
    channels = frozenset(smooth_channels(comparison.data, comparison.data.info.axes[0]))
    return tuple(drivers(kind, channels)[-1:])


def _explained_but_for_shape(first: Comparison, initial: Comparison, step: Step) -> Step:
    """Return a judgement that names the leading effect where it, a few per cent wrong in shape, beats all else."""
    effect, smooth = initial.leader(smooth=False), initial.leader(smooth=True)
    if effect is None or smooth is None or effect.log_bf < ENOUGH or overlap(initial, smooth, effect) < MOSTLY:
        return step
    if is_of_another_law(initial, effect):
        return step
    if not is_better_than_smooth(first, initial, effect, smooth, discrepancies(initial, effect)):
        return step
    group = alias_group(initial, effect)
    return Step("missing" if len(group) == 1 else "ambiguous", group, effect, step.depends_on)


def _one_by_one(
    first: Comparison, comparison: Comparison, step: Step, catalogue: Mapping[str, Effect]
) -> tuple[list[Finding], Comparison]:
    """Return the findings one after the other, each sought beside those before, and the comparison beside all."""
    findings: list[Finding] = []
    while (finding := _finding(comparison, step, catalogue)) is not None and len(findings) < STEPS:
        findings.append(finding)
        before = (comparison, step)
        comparison, step = _compared_beside(first, findings, catalogue)
        names = {name for finding in findings for name in finding.group}
        if names & set(step.group) or is_shape_error(*before, comparison, step):
            break
    return findings, comparison


def _finding(comparison: Comparison, step: Step, catalogue: Mapping[str, Effect]) -> Finding | None:
    """Return what one step found missing; None where that is no effect of the catalogue, or none predicts.

    An effect with which left-out data sets are predicted worse is not named: then another of its group is. A single one
    is not, where it has so much less evidence that the other would have been named without it.
    """
    if step.form not in {"missing", "ambiguous"} or step.leader is None:
        return None
    candidate_by_id = {c.id: c for c in comparison.candidates if not c.smooth}
    group: list[str] = []
    for name in step.group:
        if group:
            group.append(name)
            continue
        term = refined_term(comparison, candidate_by_id[name])
        if not held_out_rises(comparison, (term,), catalogue):
            group, chosen = [name], candidate_by_id[name]
            missing_term = term
    if not group or (len(group) == 1 and chosen.log_bf < step.leader.log_bf - LEAD):
        return None
    axes = axes_of(comparison, chosen)
    return Finding(tuple(group), missing_term, chosen.log_bf, discrepancies(comparison, chosen), axes)


def _compared_beside(
    first: Comparison, findings: Sequence[Finding], catalogue: Mapping[str, Effect]
) -> tuple[Comparison, Step]:
    """Return the comparison beside effects that were found, and its judgement."""
    model = first.model.with_added(finding.term for finding in findings)
    terms = with_exact_terms(first, model.terms)
    discrepancy = together([finding.discrepancy for finding in findings])
    beside = compare_beside(first, model.with_terms(terms), catalogue, discrepancy)
    return _judged(beside, catalogue, first=False)


def _finding_beside(first: Comparison, findings: Sequence[Finding], catalogue: Mapping[str, Effect]) -> Finding | None:
    """Return what is found missing beside other findings; None where that is no effect of the catalogue."""
    return _finding(*_compared_beside(first, findings, catalogue), catalogue)


def _refined_findings(first: Comparison, findings: Sequence[Finding], catalogue: Mapping[str, Effect]) -> list[Finding]:
    """Return findings, each sought again beside the others: the first was found before the others were known."""
    refined = list(findings)
    for k in range(len(refined)):
        others = refined[:k] + refined[k + 1 :]
        again = _finding_beside(first, others, catalogue)
        if again is not None and not set(again.group) & {name for other in others for name in other.group}:
            refined[k] = again
    return refined


def _judged(comparison: Comparison, catalogue: Mapping[str, Effect], *, first: bool = True) -> tuple[Comparison, Step]:
    """Return the judgement; where it is not clearly one effect, it is made again with the leaders' shapes refined."""
    step = judge(comparison, first=first)
    unclear = step.leader is None or are_exact(step.leader) or _has_rival(comparison) or may_be_step(comparison)
    if step.form == "adequate" or (step.form == "missing" and not unclear):
        return comparison, step
    comparison = with_refined_leaders(comparison, catalogue, NOTICED)
    return comparison, judge(comparison, first=first)


def _has_rival(comparison: Comparison) -> bool:
    """Return whether the evidence for another effect is so near the leader's that its shape may decide."""
    effects = [c for c in comparison.candidates if not c.smooth and c.physical][:2]
    return len(effects) == 2 and effects[1].log_bf > max(NOTICED, effects[0].log_bf - FAR)


def _pair(first: Comparison, initial: Comparison, catalogue: Mapping[str, Effect]) -> list[Finding]:
    """Return two effects that together explain what no single effect does, and leave nothing missing; else none.

    The first of a pair need not be the strongest alone: two laws of the rate mix into one that a third resembles.
    """
    smooth = initial.leader(smooth=True)
    pairs = []
    for leader in [c for c in initial.candidates if not c.smooth and c.physical and c.log_bf >= ENOUGH][:LEADERS]:
        if leader.term is None or is_of_another_law(initial, leader):
            continue
        group, axes = alias_group(initial, leader), axes_of(initial, leader)
        one = Finding(group, refined_term(initial, leader), leader.log_bf, axes=axes)
        other = _finding_beside(first, [one], catalogue)
        if other is not None and leader.id not in other.group:
            pairs.append([one, other])
    best = max(pairs, key=lambda pair: pair[0].log_bf + pair[1].log_bf, default=None)
    if best is None or smooth is None or best[0].log_bf + best[1].log_bf < smooth.log_bf + LEAD:
        return []
    best = _refined_findings(first, best, catalogue)
    return best if _compared_beside(first, best, catalogue)[1].form == "adequate" else []
