"""What the evidence comes to, in one of five forms, and never with more confidence than it has.

The thresholds are in nats of log evidence: about 3 to 1 odds against some thirty alternatives before anything is said
to be missing, and about 20 to 1 before one effect is named and its rivals are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from labctl.fitting.criticism.candidates import TIMES
from labctl.fitting.criticism.evidence import reproduced, solve_option
from labctl.fitting.criticism.model_comparison import Candidate, Comparison
from labctl.fitting.effects import Term

Form = Literal["adequate", "missing", "ambiguous", "unexplained", "insufficient_data"]

#: Less evidence than this for the best candidate: nothing is missing.
ENOUGH = 4.5
#: The same beside a cause that was found already: two at once are rarer than one.
ENOUGH_NEXT = 7.0
#: A lead of less than this over another candidate leaves both.
LEAD = 3.0
#: A rival that leaves less of the leader's signal than this (chi2), or a smaller share than that, is not told apart.
UNTOLD_CHI2 = 7.0
#: A lead from which on the evidence alone decides against a rival with more coefficients.
FAR = 12.0
ALIKE = 0.995
#: A smooth function of a channel is only then unexplained when no effect explains this share of it.
EXPLAINED = 0.90
#: The same for time, which is never a cause.
EXPLAINED_TIME = 0.75
SAME_AS_TEMPERATURE = TIMES | {"chamber_c"}
#: An effect that takes off less than this share of the excess chi2 is not named alone at the first step.
LEAST_SHARE = 0.3
#: Columns that are the same up to rounding have the same evidence within this.
SAME = 0.02
#: At most this many effects beside exact aliases in an ambiguous answer.
MOST = 4


@dataclass(frozen=True)
class Step:
    """One round of asking: what leads, whom it cannot be told from."""

    form: Form
    group: tuple[str, ...]
    leader: Candidate | None
    depends_on: tuple[str, ...] = ()
    share_removed: float = 0.0


@dataclass(frozen=True)
class Verdict:
    """The answer."""

    form: Form
    groups: tuple[tuple[str, ...], ...] = ()  #: one per cause: its name, or those that cannot be told apart, best first
    depends_on: tuple[str, ...] = ()
    reason: str = ""
    terms: Mapping[str, Term] = field(default_factory=dict)  #: effect id -> the shape that fits best

    @property
    def named(self) -> tuple[str, ...]:
        """Every effect that the verdict stands on."""
        return tuple(name for group in self.groups for name in group)

    @property
    def untold(self) -> tuple[str, ...]:
        """The first group of effects that cannot be told apart; empty where all can."""
        return next((group for group in self.groups if len(group) > 1), ())


def judge(weighed: Comparison, *, first: bool = True) -> Step:
    """Judge one round of evidence: the first, or one beside causes that were found already."""
    enough = ENOUGH if first else ENOUGH_NEXT
    effect, smooth = weighed.leader(smooth=False), weighed.leader(smooth=True)
    strongest = max((c.log_bf for c in (effect, smooth) if c is not None), default=-np.inf)
    if strongest < enough:
        return Step("adequate", (), effect)
    depends = channels_behind(weighed)
    if smooth is not None and (effect is None or _is_unexplained(weighed, effect, smooth)):
        return Step("unexplained", (), smooth, depends or (smooth.id,))
    if effect is None or effect.log_bf < enough:
        return Step("unexplained", (), smooth, depends)
    share = share_removed(weighed, effect)
    group = alias_group(weighed, effect)
    if len(group) == 1 and first and share < LEAST_SHARE:
        return Step("ambiguous", group, effect, depends, share)
    return Step("missing" if len(group) == 1 else "ambiguous", group, effect, depends, share)


def _is_unexplained(weighed: Comparison, effect: Candidate, smooth: Candidate) -> bool:
    if smooth.log_bf <= effect.log_bf + LEAD:
        return False
    limit = EXPLAINED_TIME if smooth.id in TIMES else EXPLAINED
    return overlap(weighed, smooth, effect) < limit


def alias_group(weighed: Comparison, leader: Candidate) -> tuple[str, ...]:
    """Return the leader and the effects that the data cannot tell from it, best first."""
    near = []
    for rival in weighed.candidates:
        if rival.smooth or rival.id == leader.id:
            continue
        close = rival.log_bf > leader.log_bf - LEAD
        if close or (rival.log_bf > 0 and _is_untold(weighed, leader, rival)):
            near.append(rival)
    exact = [r for r in near if abs(r.log_bf - leader.log_bf) < SAME]
    others = [r for r in near if r not in exact][:MOST]
    return (leader.id, *(r.id for r in exact), *(r.id for r in others))


def _is_untold(weighed: Comparison, leader: Candidate, rival: Candidate) -> bool:
    """Whether a rival would leave hardly anything of the leader's signal, without having bought that dearly.

    A rival with more coefficients follows anything; far less evidence counts against it, and it only stays while little
    does.
    """
    share = overlap(weighed, leader, rival)
    if share > ALIKE and _directions(weighed, rival) <= _directions(weighed, leader):
        return True
    return rival.log_bf > leader.log_bf - FAR and (1.0 - share) * leader.gain < UNTOLD_CHI2


def _directions(weighed: Comparison, candidate: Candidate) -> int:
    return sum(int(weighed.axes[axis].dimensions[option]) for axis, option in candidate.option.items())


def overlap(weighed: Comparison, leader: Candidate, rival: Candidate) -> float:
    """Return which share of the leader's fitted signal the rival's best shape on each axis reproduces, 0 to 1."""
    part = whole = 0.0
    for axis, option in leader.option.items():
        left, slices = weighed.axes[axis].best, weighed.axes[axis].slices
        shared, size = (
            reproduced(left, slices[option], slices[rival.option[axis]])
            if axis in rival.option
            else (0.0, reproduced(left, slices[option], slices[option])[1])
        )
        part, whole = part + shared, whole + size
    return part / whole if whole > 0 else 0.0


def share_removed(weighed: Comparison, candidate: Candidate) -> float:
    """Return the share of the excess chi2, over all axes, that a candidate takes off."""
    removed, excess = 0.0, 0.0
    for axis, found in weighed.axes.items():
        freedom = found.rows - found.base_columns
        excess += max(found.best.chi2 - freedom, 0.0)
        if axis in candidate.option:
            removed += float(found.gain[candidate.option[axis]])
    return removed / max(excess, removed, 1e-12)


def channels_behind(weighed: Comparison) -> tuple[str, ...]:
    """Return the channels that the residual hangs on, strongest first."""
    found = [c for c in weighed.candidates if c.smooth and c.log_bf >= ENOUGH]
    temperature = next((c for c in found if c.id == "temperature_c"), None)
    # on one rising leg time and the chamber's temperature are the same variable as the gyro's temperature
    same = temperature is not None and found[0].id in SAME_AS_TEMPERATURE
    if temperature is not None and same and overlap(weighed, found[0], temperature) > EXPLAINED_TIME:
        found = [temperature, *(c for c in found if c is not temperature)]
    return tuple(c.id for c in found)


def probabilities(candidates: Sequence[Candidate]) -> dict[str, float]:
    """Return how probable each effect is, one of them or nothing being missing, nothing as likely as all together."""
    effects = [c for c in candidates if not c.smooth]
    log_bf = np.array([c.log_bf for c in effects]) - np.log(max(len(effects), 1))
    top = max(float(log_bf.max(initial=0.0)), 0.0)
    weights = np.exp(log_bf - top)
    total = weights.sum() + np.exp(-top)
    return {c.id: float(w / total) for c, w in zip(effects, weights, strict=True)}


def coefficients_of(weighed: Comparison, candidate: Candidate) -> dict[str, dict[str, dict[str, float | str]]]:
    """Return axis -> name -> value, standard uncertainty and unit of a candidate's best shape beside the base."""
    found: dict[str, dict[str, dict[str, float | str]]] = {}
    for axis, index in candidate.option.items():
        option = weighed.designs[axis].options[index]
        values, covariance = solve_option(weighed.axes[axis].best, weighed.axes[axis].slices[index])
        u = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        found[axis] = {
            name: {"value": float(value), "u": float(error), "unit": unit}
            for name, unit, value, error in zip(option.names, option.units, values, u, strict=True)
        }
    return found
