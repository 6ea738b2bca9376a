"""Verdict of a criticism: one of five forms, never with more confidence than the evidence has.

The thresholds are in nats of log evidence: about 3 to 1 odds against some thirty alternatives before anything is said
to be missing, and about 20 to 1 before one effect is named and its rivals are not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from labctl.answers.criticism import Remainder
from labctl.answers.fitted_model import Coefficient
from labctl.fitting.criticism.channel_functions import TIMES
from labctl.fitting.criticism.evidence.drawn_shifts import reproduced_by_draws
from labctl.fitting.criticism.evidence.further_coefficients import further_nats
from labctl.fitting.criticism.evidence.gains import reproduced_and_size, solve_option
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.rivals import (
    FAR,
    LEAD,
    Pair,
    are_aliases_by_draws,
    cannot_be_distinguished,
    is_drawn,
    log_bf_beside,
)
from labctl.fitting.effects import Term
from labctl.fitting.effects.derived import with_derived

Form = Literal["adequate", "missing", "ambiguous", "unexplained", "insufficient_data"]
#: What an unexplained residual may be caused by that is no effect of the catalogue.
Hypothesis = Literal["temperature_not_logged"]

#: Less evidence than this for the best candidate: nothing is missing.
ENOUGH = 4.5
#: The same beside a cause that was found already: two at once are rarer than one.
ENOUGH_NEXT = 7.0
#: A smooth function of a channel counts as unexplained only when no effect explains this share of it.
EXPLAINED = 0.90
#: The same for time, which is never a cause.
EXPLAINED_TIME = 0.75
SAME_AS_TEMPERATURE = TIMES | {"chamber_c"}
#: An effect that takes off less than this share of the excess chi2 is not named alone at the first step.
MIN_SHARE = 0.3
#: A time constant of at least this share of the longest (the shortest: of its inverse) is at the end of its range.
NEAR_END = 0.9
#: Columns that are the same up to rounding have the same evidence within this.
SAME = 0.02
#: At most this many effects in a group of an ambiguous answer, beside exact aliases of the first and of the last.
MOST = 4
#: A channel of which another explains more than this share cannot be distinguished from it.
CONFOUNDED = 0.9


@dataclass(frozen=True)
class Step:
    """Judgement of one step of the search: the leader, and the effects that cannot be distinguished from it."""

    form: Form
    group: tuple[str, ...]
    leader: Candidate | None
    depends_on: tuple[str, ...] = ()
    share_removed: float = 0.0


@dataclass(frozen=True)
class Verdict:
    """The answer."""

    form: Form
    #: One per missing effect: its id, or those that cannot be distinguished, best first.
    groups: tuple[tuple[str, ...], ...] = ()
    depends_on: tuple[str, ...] = ()
    reason: str = ""
    terms: Mapping[str, Term] = field(default_factory=dict)  #: effect id -> the shape that fits best
    confounded: tuple[str, ...] = ()  #: channels that this schedule cannot distinguish from the first of `depends_on`
    not_physical: tuple[str, ...] = ()  #: effects alike in these data, at a size that this technology cannot have
    remainder: Remainder | None = None  #: share of the excess that what is named leaves, and its channels
    further: tuple[tuple[str, ...], ...] = ()  #: of an adequate model: what would take off noise, and is not missing
    axes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  #: leading effect id -> the axes that show it
    hypothesis: Hypothesis | None = None  #: what the likeliest cause of an unexplained residual is, if there is one

    @property
    def named(self) -> tuple[str, ...]:
        """The ids of all effects that the verdict names."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group))

    @property
    def indistinguishable(self) -> tuple[str, ...]:
        """The first group of effects that cannot be distinguished; empty where all can."""
        return next((group for group in self.groups if len(group) > 1), ())


def judge(comparison: Comparison, *, first: bool = True) -> Step:
    """Judge a comparison: the first, or one beside effects that were found already."""
    enough = ENOUGH if first else ENOUGH_NEXT
    effect, smooth = comparison.leader(smooth=False), comparison.leader(smooth=True)
    strongest = max((c.log_bf for c in (effect, smooth) if c is not None), default=-np.inf)
    if strongest < enough:
        return Step("adequate", (), effect)
    depends = channels_behind(comparison)
    if smooth is not None and (effect is None or _is_unexplained(comparison, effect, smooth)):
        return Step("unexplained", (), smooth, depends or (smooth.id,))
    if effect is not None and refines_base(comparison, effect):
        effect = _other_than_refined(comparison, effect)
    if effect is None or effect.log_bf < enough:
        return Step("unexplained", (), smooth, depends)
    share = share_removed(comparison, effect)
    group = alias_group(comparison, effect)
    if len(group) == 1 and first and 0.0 < share < MIN_SHARE:
        return Step("ambiguous", group, effect, depends, share)
    return Step("missing" if len(group) == 1 else "ambiguous", group, effect, depends, share)


def _is_unexplained(comparison: Comparison, effect: Candidate, smooth: Candidate) -> bool:
    if is_at_end(comparison, effect):
        return smooth.log_bf > effect.log_bf - LEAD
    if smooth.log_bf <= effect.log_bf + LEAD:
        return False
    if _directions(comparison, smooth) < _directions(comparison, effect):  # simpler, and still better
        return True
    limit = EXPLAINED_TIME if smooth.id in TIMES else EXPLAINED
    return overlap(comparison, smooth, effect) < limit


def refines_base(comparison: Comparison, effect: Candidate) -> bool:
    """Return whether the base has an effect in a lower order: then it is not missing, its law is not exact."""
    if effect.term is None or effect.term.order is None:
        return False
    orders = [
        (option.term.order, int(comparison.axes[axis].dimensions[i]))
        for axis, design in comparison.designs.items()
        for i, option in enumerate(design.options)
        if option.candidate == effect.id and option.term is not None and option.term.order is not None
    ]
    lowest = min(order for order, _ in orders)
    return effect.term.order > lowest and all(directions == 0 for order, directions in orders if order == lowest)


def _other_than_refined(comparison: Comparison, refined: Candidate) -> Candidate | None:
    """Return the best effect that is new to the base and cannot be distinguished from one that is not."""
    near = (rival for rival in _alike(comparison, refined, physical=True) if not refines_base(comparison, rival))
    effect = next(near, None)
    smooth = comparison.leader(smooth=True)
    return None if effect is None or (smooth is not None and _is_unexplained(comparison, effect, smooth)) else effect


def is_of_another_law(comparison: Comparison, effect: Candidate) -> bool:
    """Return whether an effect is only the nearest one of the catalogue to a law outside the catalogue."""
    return is_at_end(comparison, effect) or refines_base(comparison, effect)


def is_at_end(comparison: Comparison, effect: Candidate, *, shortest: bool = False) -> bool:
    """Return whether the longest (or `shortest`) time constant of an effect fits clearly best: its law is another."""
    if effect.term is None or "tau_s" not in effect.term.parameters:
        return False
    lead, sign = 0.0, -1.0 if shortest else 1.0
    for axis in effect.option:
        terms = {i: o.term for i, o in enumerate(comparison.designs[axis].options) if o.candidate == effect.id}
        tau_s = {i: term.parameters["tau_s"] ** sign for i, term in terms.items() if term is not None}
        end, axis_log_bf = NEAR_END * max(tau_s.values()), comparison.axes[axis].log_bf
        last = max(float(axis_log_bf[i]) for i, tau in tau_s.items() if tau >= end)
        inner = max((float(axis_log_bf[i]) for i, tau in tau_s.items() if tau < end), default=-np.inf)
        lead += last - inner if np.isfinite(last) and np.isfinite(inner) else 0.0
    return lead > LEAD


def alias_group(comparison: Comparison, leader: Candidate) -> tuple[str, ...]:
    """Return the leader and the effects that the data cannot distinguish from it, best first.

    At most `MOST`, and beyond them those whose columns are the same as the leader's or as the last one's, or as those
    of so few draws.
    """
    near = _alike(comparison, leader, physical=True)
    exact = [r for r in near if abs(r.log_bf - leader.log_bf) < SAME]
    others = [r for r in near if r not in exact]
    if len(others) >= MOST:
        last = others[MOST - 2].log_bf
        others = [r for r in others if r.log_bf > last - SAME or are_aliases_by_draws(_pair(comparison, leader, r))]
    return (leader.id, *(r.id for r in exact), *(r.id for r in others))


def not_physical_group(comparison: Comparison, leader: Candidate) -> tuple[str, ...]:
    """Return the effects that are alike in these data, but at a size that the unit's technology cannot have."""
    return tuple(rival.id for rival in _alike(comparison, leader, physical=False))


def _alike(comparison: Comparison, leader: Candidate, *, physical: bool) -> list[Candidate]:
    return [
        rival
        for rival in comparison.candidates
        if not rival.smooth
        and rival.physical == physical
        and rival.id != leader.id
        and cannot_be_distinguished(_pair(comparison, leader, rival))
    ]


@dataclass(frozen=True)
class _MeasuredPair(Pair):
    """A leader and a rival of a comparison."""

    comparison: Comparison

    @property
    def share(self) -> float:
        return overlap(self.comparison, self.leader, self.rival)

    @property
    def further_directions(self) -> int:
        return _directions(self.comparison, self.rival) - _directions(self.comparison, self.leader)

    @property
    def further_gain(self) -> float:
        return self.rival.gain - self.leader.gain

    @property
    def further_nats(self) -> float:
        of_axes = self.leader.option.items()
        return sum(_further_nats(self.comparison, axis, i, self.rival.option[axis]) for axis, i in of_axes)

    @property
    def has_as_simple_a_shape(self) -> bool:
        return has_as_simple_a_shape(self.comparison, self.leader, self.rival)

    @property
    def share_by_draws(self) -> float:
        fixed, drawn = (self.rival, self.leader) if is_drawn(self.leader) else (self.leader, self.rival)
        return overlap_by_draws(self.comparison, fixed, drawn)


def _pair(comparison: Comparison, leader: Candidate, rival: Candidate) -> Pair:
    log_bf = log_bf_beside(leader, rival), log_bf_beside(rival, leader)
    return _MeasuredPair(leader, rival, *log_bf, leader.gain, comparison)


def has_as_simple_a_shape(comparison: Comparison, leader: Candidate, rival: Candidate) -> bool:
    """Return whether a shape of the rival with no more coefficients than the leader is not far behind it.

    A cubic is such a shape of a polynomial of fifth order, beside a sine.
    """
    behind = 0.0
    for axis, best in leader.option.items():
        evidence, options = comparison.axes[axis], comparison.designs[axis].options
        is_rival = [option.candidate == rival.id and not option.smooth for option in options]
        is_simple = evidence.dimensions <= evidence.dimensions[best]
        behind += float(evidence.log_bf[best] - np.max(evidence.log_bf, initial=-np.inf, where=is_rival & is_simple))
    return behind < FAR


def _further_nats(comparison: Comparison, axis: str, simple: int, wider: int) -> float:
    """Return the evidence on an axis against the further coefficients of a wider option, nats."""
    eliminated, slices = comparison.axes[axis].best, comparison.axes[axis].slices
    values, covariance = solve_option(eliminated, slices[wider])
    through = covariance @ eliminated.gram[slices[wider], slices[simple]]
    size = np.sqrt(np.mean(comparison.designs[axis].options[wider].rows[0] ** 2, axis=0))
    return further_nats(values, covariance, through, solve_option(eliminated, slices[simple])[0], size)


def axes_of(comparison: Comparison, candidate: Candidate) -> tuple[str, ...]:
    """Return the axes on which there is evidence for a candidate; all of its axes where no single one has enough."""
    shown_axes = [axis for axis, i in candidate.option.items() if comparison.axes[axis].log_bf[i] >= LEAD]
    return tuple(shown_axes or candidate.option)


def confounded_with(comparison: Comparison, channel: str) -> tuple[str, ...]:
    """Return the channels that this schedule cannot distinguish from one on which the residual depends.

    Where temperatures only rose, a step in time is also a step in temperature.
    """
    smooth = [c for c in comparison.candidates if c.smooth and c.log_bf > 0]
    first = next((c for c in smooth if c.id == channel and c.log_bf >= ENOUGH), None) or comparison.candidates[0]
    return tuple(
        c.id
        for c in smooth
        if c.id != channel
        and (
            (c.log_bf >= ENOUGH and c.log_bf > first.log_bf - FAR)
            or (c is not first and overlap(comparison, first, c) > CONFOUNDED)
        )
    )


def _directions(comparison: Comparison, candidate: Candidate) -> int:
    return sum(int(comparison.axes[axis].dimensions[option]) for axis, option in candidate.option.items())


def overlap(comparison: Comparison, leader: Candidate, rival: Candidate) -> float:
    """Return which share of the leader's fitted signal the rival's best shape on each axis reproduces, 0 to 1."""
    part = whole = 0.0
    for axis, option in leader.option.items():
        eliminated, slices = comparison.axes[axis].best, comparison.axes[axis].slices
        shared, size = (
            reproduced_and_size(eliminated, slices[option], slices[rival.option[axis]])
            if axis in rival.option
            else (0.0, reproduced_and_size(eliminated, slices[option], slices[option])[1])
        )
        part, whole = part + shared, whole + size
    return part / whole if whole > 0 else 0.0


def overlap_by_draws(comparison: Comparison, fixed: Candidate, drawn: Candidate) -> float:
    """Return which share of a fitted signal as many draws of a shift reproduce as it has coefficients, 0 to 1."""
    part = whole = 0.0
    for axis, option in fixed.option.items():
        of_axis = comparison.axes[axis]
        signal, gram = of_axis.slices[option], of_axis.best.gram
        values, _ = solve_option(of_axis.best, signal)
        whole += float(values @ gram[signal, signal] @ values)
        if axis in drawn.option:
            by = of_axis.slices[drawn.option[axis]]
            part += reproduced_by_draws(gram[by, by], gram[by, signal] @ values, int(of_axis.dimensions[option]))
    return part / whole if whole > 0 else 0.0


def share_removed(comparison: Comparison, candidate: Candidate) -> float:
    """Return the share of the excess chi2, over all axes, that a candidate removes, 0 to 1; 0 without any excess."""
    removed, excess = 0.0, 0.0
    for axis, axis_comparison in comparison.axes.items():
        freedom = axis_comparison.rows - axis_comparison.base_columns
        excess += max(axis_comparison.best.chi2 - freedom, 0.0)
        if axis in candidate.option:
            removed += float(axis_comparison.gain[candidate.option[axis]])
    return removed / max(excess, removed) if excess > 0 and removed > 0 else 0.0


def channels_behind(comparison: Comparison) -> tuple[str, ...]:
    """Return the channels on which the residual depends, strongest first."""
    smooth_channels = [c for c in comparison.candidates if c.smooth and c.log_bf >= ENOUGH]
    temperature = next((c for c in smooth_channels if c.id == "temperature_c"), None)
    # while the temperature only rises, time and chamber temperature are the same variable as the gyro's temperature
    same = temperature is not None and smooth_channels[0].id in SAME_AS_TEMPERATURE
    if temperature is not None and same and overlap(comparison, smooth_channels[0], temperature) > EXPLAINED_TIME:
        smooth_channels = [temperature, *(c for c in smooth_channels if c is not temperature)]
    return tuple(c.id for c in smooth_channels)


def probabilities(candidates: Sequence[Candidate]) -> dict[str, float]:
    """Return effect id -> probability that it is the one missing; 0 for a size that the technology cannot have.

    The prior probability that nothing is missing is that of all effects together.
    """
    effects = [c for c in candidates if not c.smooth]
    log_bf = np.array([c.log_bf if c.physical else -np.inf for c in effects]) - np.log(max(len(effects), 1))
    top = float(log_bf.max(initial=0.0))
    weights = np.exp(log_bf - top)
    total = weights.sum() + np.exp(-top)
    return {c.id: float(w / total) for c, w in zip(effects, weights, strict=True)}


def coefficients_of(comparison: Comparison, candidate: Candidate) -> dict[str, dict[str, Coefficient]]:
    """Return axis -> name -> value, standard uncertainty and unit of a candidate's best shape beside the base."""
    by_axis: dict[str, dict[str, Coefficient]] = {}
    for axis, index in candidate.option.items():
        option = comparison.designs[axis].options[index]
        values, covariance = solve_option(comparison.axes[axis].best, comparison.axes[axis].slices[index])
        u = np.sqrt(np.diag(covariance))
        by_axis[axis] = with_derived({
            name: {"value": float(value), "u": float(error), "unit": unit_symbol}
            for name, unit_symbol, value, error in zip(option.names, option.units, values, u, strict=True)
        })  # fmt: skip
    return by_axis
