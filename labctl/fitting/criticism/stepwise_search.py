"""Asking until nothing more is missing: what is named is added to the model, and everything is weighed again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence import solve_option
from labctl.fitting.criticism.model_comparison import Candidate, Comparison, weigh_beside
from labctl.fitting.criticism.refine import refined, sharpened
from labctl.fitting.criticism.verdict import (
    ALIKE,
    ENOUGH,
    FAR,
    LEAD,
    Form,
    Step,
    Verdict,
    channels_behind,
    judge,
    overlap,
)
from labctl.fitting.effects import Effect, Term

#: How many effects may be found missing one after the other.
STEPS = 4
#: From this evidence on, an effect is worth refining its shape.
NOTICED = 1.0
#: How many of the strongest are tried as the first of a pair.
LEADERS = 4
#: The next effect is only named when at least this share of the evidence for the one before speaks for it, where it
#: does most: less is the wrong shape of the one before.
NEXT_SHARE = 0.04
#: The same after effects that could not be told apart: one of the others may fit better than the one that was added.
NEXT_SHARE_UNTOLD = 0.08
#: As if at least this share of every effect lay on either side, within data sets and between them.
SPILLS = 0.05


@dataclass(frozen=True)
class Finding:
    """What was found missing: the effect that leads, in its best shape, and those that it cannot be told from."""

    group: tuple[str, ...]
    term: Term
    log_bf: float


def search_stepwise(first: Comparison, catalogue: Mapping[str, Effect]) -> tuple[Verdict, Comparison, Comparison]:
    """Ask, add what is named, and ask again, until nothing more is.

    Returns the verdict, the first weighing with its leaders' shapes refined, and the last.
    """
    depends = channels_behind(first)
    begun, step = _judged(first, catalogue)
    if step.form == "unexplained":
        causes = _pair(first, begun, catalogue)
        form, last = _form(causes) if causes else step.form, begun
        depends = depends or step.depends_on
    else:
        causes, last = _one_by_one(first, begun, step, catalogue)
        form = _form(causes) if len(causes) > 1 else step.form
    terms = {cause.term.effect: cause.term for cause in causes}
    kept = depends if causes or form == "unexplained" else ()
    return Verdict(form, tuple(cause.group for cause in causes), kept, terms=terms), begun, last


def _form(causes: Sequence[Finding]) -> Form:
    return "missing" if all(len(cause.group) == 1 for cause in causes) else "ambiguous"


def _one_by_one(
    first: Comparison, weighed: Comparison, step: Step, catalogue: Mapping[str, Effect]
) -> tuple[list[Finding], Comparison]:
    """Return one cause after the other, each sought beside those before, and what is left beside all."""
    causes: list[Finding] = []
    while (cause := _cause(weighed, step)) is not None and len(causes) < STEPS:
        causes.append(cause)
        before = (weighed, step)
        weighed, step = _asked_beside(first, causes, catalogue)
        known = {name for cause in causes for name in cause.group}
        if known & set(step.group) or _is_shape_error(*before, weighed, step):
            break
    return causes, weighed


def _cause(weighed: Comparison, step: Step) -> Finding | None:
    """Return what one round of asking found; None where that has no name."""
    leader = step.leader
    if step.form not in {"missing", "ambiguous"} or leader is None or leader.term is None:
        return None
    return Finding(step.group, refined(weighed, leader), leader.log_bf)


def _asked_beside(
    first: Comparison, causes: Sequence[Finding], catalogue: Mapping[str, Effect]
) -> tuple[Comparison, Step]:
    """Return everything weighed and judged once more, beside causes that were found."""
    terms = (*first.model.terms, *(replace(cause.term, steady=True) for cause in causes))
    return _judged(weigh_beside(first, first.model.with_terms(terms), catalogue), catalogue, first=False)


def _beside(first: Comparison, causes: Sequence[Finding], catalogue: Mapping[str, Effect]) -> Finding | None:
    """Return what is found missing beside other causes; None where nothing is that has a name."""
    return _cause(*_asked_beside(first, causes, catalogue))


def _settled(first: Comparison, causes: Sequence[Finding], catalogue: Mapping[str, Effect]) -> list[Finding]:
    """Return causes each sought again beside the others: the first was found when nothing of them was known."""
    found = list(causes)
    for k in range(len(found)):
        others = found[:k] + found[k + 1 :]
        again = _beside(first, others, catalogue)
        if again is not None and not set(again.group) & {name for other in others for name in other.group}:
            found[k] = again
    return found


def _is_shape_error(before: Comparison, named: Step, after: Comparison, step: Step) -> bool:
    """Whether what leads now may be what the shape of the effect that was just added left.

    Held against what that effect did where the new one does most: the wrong shape of a wave within data sets leaves
    waves, and hardly anything between them.
    """
    if step.leader is None or named.leader is None:
        return False
    least = NEXT_SHARE if _is_one(before, named) else NEXT_SHARE_UNTOLD
    of_new, of_old = _within_and_between(after, step.leader), _within_and_between(before, named.leader)
    there = int(np.argmax(of_new))
    could = max(float(of_old[there]), SPILLS) * named.leader.log_bf
    return bool(of_new[there] * step.leader.log_bf < least * could)


def _is_one(weighed: Comparison, named: Step) -> bool:
    """Whether a group is one effect, or several of which each would give just what the leader gives."""
    others = [c for c in weighed.candidates if not c.smooth and c.id in named.group[1:]]
    return all(overlap(weighed, named.leader, other) > ALIKE for other in others) if named.leader else False


def _within_and_between(weighed: Comparison, candidate: Candidate) -> NDArray[np.float64]:
    """Return the shares of a candidate's signal beside the base that lie within data sets, and between them."""
    total = np.zeros(2)
    for axis, index in candidate.option.items():
        design, found = weighed.designs[axis], weighed.axes[axis]
        values, _ = solve_option(found.best, found.slices[index])
        scale = weighed.scales[axis].copy()
        scale[0] = np.sqrt(weighed.white_var[axis] + found.best.noise.size_dps**2)
        kept = design.present
        base, signal = (rows[kept] / scale[kept][:, None] for rows in (design.base, design.options[index].rows))
        size = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
        taken, *_ = np.linalg.lstsq(base / size, signal @ values, rcond=1e-9)
        left = np.zeros(kept.shape)
        left[kept] = signal @ values - base / size @ taken
        total += (np.sum(left[1:] ** 2), np.sum(left[0] ** 2))
    return np.asarray(total / max(float(total.sum()), 1e-300))


def _judged(weighed: Comparison, catalogue: Mapping[str, Effect], *, first: bool = True) -> tuple[Comparison, Step]:
    """Judge, and where the answer is no single name, or hardly, judge again with the leaders' shapes refined."""
    step = judge(weighed, first=first)
    if step.form == "adequate" or (step.form == "missing" and not _has_rival(weighed)):
        return weighed, step
    weighed = sharpened(weighed, catalogue, NOTICED)
    return weighed, judge(weighed, first=first)


def _has_rival(weighed: Comparison) -> bool:
    """Whether another effect is so near the leader that its shape may decide."""
    effects = [c for c in weighed.candidates if not c.smooth][:2]
    return len(effects) == 2 and effects[1].log_bf > max(NOTICED, effects[0].log_bf - FAR)


def _pair(first: Comparison, begun: Comparison, catalogue: Mapping[str, Effect]) -> list[Finding]:
    """Return two effects that explain together what looked like something else, and leave nothing; or none.

    The first of a pair need not be the strongest alone: two laws of the rate mix into one that a third resembles.
    """
    smooth = begun.leader(smooth=True)
    pairs = []
    for leader in [c for c in begun.candidates if not c.smooth and c.log_bf >= ENOUGH][:LEADERS]:
        if leader.term is None:
            continue
        one = Finding((leader.id,), refined(begun, leader), leader.log_bf)
        other = _beside(first, [one], catalogue)
        if other is not None and leader.id not in other.group:
            pairs.append([one, other])
    best = max(pairs, key=lambda pair: pair[0].log_bf + pair[1].log_bf, default=None)
    if best is None or smooth is None or best[0].log_bf + best[1].log_bf < smooth.log_bf + LEAD:
        return []
    best = _settled(first, best, catalogue)
    _, step = _asked_beside(first, best, catalogue)
    return best if step.form == "adequate" else []
