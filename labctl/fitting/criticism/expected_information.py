"""Expected information of a planned recording: what it would add to the knowledge of which effect is missing.

The suspects of a criticism are hypotheses with posterior probabilities. Each in turn is taken as the truth, with its
shape and size drawn from their posterior distribution; what the planned recording then gives is drawn too, and the
evidence of both recordings together (base coefficients and drifts of the new session free) gives the probabilities
after it. The mean of log2(probability of the truth after / before) is the expected information in the identity of the
cause, in bit (Lindley 1956; Box and Hill 1967, of which it is what their bound bounds). Everything is linear and normal
for one shape, so an outcome is a draw of the inner products of the shapes with the data, and no reading is simulated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Motion
from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.joint_evidence import AxisForecast, Fitted, Outcomes, forecast_axis
from labctl.fitting.criticism.model_comparison import Comparison, compare_beside
from labctl.fitting.criticism.planned_addition import may_be_joined, with_planned
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.reduction import ReducedRecording
from labctl.fitting.criticism.rivals import LEAD, Pair, cannot_be_distinguished, is_drawn, is_size_averaged
from labctl.fitting.criticism.verdict import ENOUGH, has_as_simple_a_shape, refines_base
from labctl.fitting.effects import CATALOGUE, Effect
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.log_evidence import on_all_axes_or_one

#: Suspects that are less likely than this are left out, unless the verdict names them.
MIN_PROBABILITY = 0.01
#: Hypotheses at most, the likeliest.
MAX_HYPOTHESES = 8
#: Outcomes that are drawn for each experiment, about, and at least for each hypothesis.
DRAWS, MIN_DRAWS = 120, 12
#: No outcome counts as stronger than this against the truth, nats: beyond it the forecast is not good enough.
MAX_LOSS = 7.0
#: An effect with at least this evidence, nats, beside a model that is adequate is a question: it may be missing.
WEAK = 2.0
#: The hypothesis that nothing is missing, among the ids of a question.
NOTHING = "nothing"
#: Two effects are distinguished where the rival falls behind in at least this share of outcomes.
USUALLY = 0.5


@dataclass(frozen=True)
class OpenQuestion:
    """Which of several effects is missing, beside a model and all else that was found."""

    comparison: Comparison  #: of the effects in question alone
    catalogue: Mapping[str, Effect]
    candidates: tuple[Candidate, ...]  #: the hypotheses, likeliest first
    log_odds: Array  #: (h,) posterior, nats, up to a constant
    nodes: NDArray[np.int64]  #: (h,) number of the cause: effects with the same columns on every schedule are one
    simple: frozenset[tuple[str, str]]  #: leaders and rivals that have a shape with as few coefficients, not far behind

    @property
    def ids(self) -> tuple[str, ...]:
        """The ids of the hypotheses."""
        return tuple(candidate.id for candidate in self.candidates)

    @property
    def effects(self) -> tuple[str, ...]:
        """The ids of the effects that may be missing, likeliest first."""
        return tuple(name for name in self.ids if name != NOTHING)

    def may_join(self, motion: Motion) -> bool:
        """Return whether a recording of a motion can be fitted together with those that were criticised."""
        return may_be_joined(self.comparison.data.info.motion, motion)

    @property
    def probabilities(self) -> Array:
        """The posterior probability of each hypothesis, (h,)."""
        return np.asarray(np.exp(self.log_odds - np.logaddexp.reduce(self.log_odds)))

    @property
    def entropy_bit(self) -> float:
        """What is not known of which cause it is, in bit; exact aliases are one."""
        p = np.bincount(self.nodes, weights=self.probabilities)
        return float(-np.sum(p[p > 0] * np.log2(p[p > 0])))


@dataclass(frozen=True)
class Forecast:
    """What a planned recording is expected to say."""

    information_bit: float  #: expected information in the identity of the cause
    u_bit: float  #: standard error of it by the number of outcomes drawn
    names_one: float  #: probability that the verdict on all recordings then names one cause
    names_wrong: float  #: probability that it then names one that is not the truth
    distinguished: tuple[str, ...]  #: ids of the effects that fall behind the likeliest one, where that is the truth


def open_question(criticism: Criticism) -> OpenQuestion | None:
    """Return what a criticism leaves open: its first group of effects that cannot be distinguished; None for none.

    Beside an adequate model: whether effects are missing for which there is some evidence, but not enough to say so.
    """
    group = criticism.verdict.indistinguishable
    if criticism.beside_missing is None:
        return None
    if criticism.verdict.form == "adequate":
        return _whether_any(criticism.beside_missing)
    if not group:
        return None
    comparison = criticism.beside_missing
    others = [names[0] for names in criticism.verdict.groups if names != group]
    terms = [criticism.verdict.terms[name] for name in others if name in criticism.verdict.terms]
    if terms:
        model = comparison.model.with_added(terms)
        comparison = compare_beside(comparison, model)
    known = {c.id: c for c in comparison.candidates if not c.smooth and np.isfinite(c.log_bf)}
    of_group = [known[name] for name in group if name in known]
    if len(of_group) < 2:
        return None
    lead = max(c.log_bf for c in of_group)
    near = [
        c for name, c in known.items()
        if name not in group and name not in others and c.physical and c.log_bf > lead + np.log(MIN_PROBABILITY)
    ]  # fmt: skip
    # shapes are compared on a grid, so that the verdict does not let small differences of the evidence decide
    odds = {c.id: max(c.log_bf, lead - LEAD) for c in of_group} | {c.id: c.log_bf for c in near}
    chosen = sorted((*of_group, *near), key=lambda c: -odds[c.id])[:MAX_HYPOTHESES]
    return _question(comparison, chosen, odds)


def _whether_any(comparison: Comparison) -> OpenQuestion | None:
    """Return the question whether one of the effects with some evidence is missing; None where none has any.

    That nothing is missing is as probable beforehand as that one of all effects is, as `verdict.probabilities` has it.
    """
    effects = [c for c in comparison.candidates if not c.smooth and c.physical and np.isfinite(c.log_bf)]
    near = [c for c in effects if c.log_bf > effects[0].log_bf + np.log(MIN_PROBABILITY)][: MAX_HYPOTHESES - 1]
    if not near or near[0].log_bf < WEAK or refines_base(comparison, near[0]):
        return None
    nothing = Candidate(NOTHING, smooth=False, log_bf=0.0, option={}, term=None, gain=0.0)
    odds = {c.id: c.log_bf for c in near} | {NOTHING: float(np.log(len(effects)))}
    chosen = sorted((*near, nothing), key=lambda c: -odds[c.id])
    return _question(comparison, chosen, odds)


def _question(comparison: Comparison, chosen: Sequence[Candidate], odds: Mapping[str, float]) -> OpenQuestion:
    """Return the question which of some hypotheses of a comparison is true; `odds` are their posterior, nats, by id."""
    ids = [c.id for c in chosen]
    effects = [c for c in chosen if c.id != NOTHING]
    simple = frozenset(
        (leader.id, rival.id)
        for leader in effects
        for rival in effects
        if rival is not leader and has_as_simple_a_shape(comparison, leader, rival)
    )
    return OpenQuestion(
        _restricted(comparison, ids), {name: CATALOGUE[name] for name in ids if name in CATALOGUE},
        tuple(chosen), np.array([odds[name] for name in ids]), _nodes(ids, comparison.data), simple,
    )  # fmt: skip


def _nodes(ids: Sequence[str], data: ReducedRecording) -> NDArray[np.int64]:
    """Return the number of the cause of each effect, (h,); another radius distinguishes effects by the one it is at."""
    numbers: list[int] = []
    for i, name in enumerate(ids):
        aliases = CATALOGUE[name].aliases_in(data.nodes) if name in CATALOGUE else ()
        same = (numbers[k] for k in range(i) if ids[k] in aliases)
        numbers.append(next(same, i))
    return np.unique(numbers, return_inverse=True)[1].astype(np.int64)


def _restricted(comparison: Comparison, ids: Sequence[str]) -> Comparison:
    """Return a comparison whose designs have the shapes of some effects only; its evidence is not theirs any more."""
    designs = {
        axis: replace(design, options=[o for o in design.options if not o.smooth and o.candidate in ids])
        for axis, design in comparison.designs.items()
    }
    return replace(comparison, designs=designs)


@single_threaded
def forecast(question: OpenQuestion, planned: ReducedRecording, seed: int = 1) -> Forecast:
    """Return what a planned recording is expected to add to a question. Raises BadInput where it cannot be joined."""
    comparison = question.comparison
    data = with_planned(comparison.data, planned, comparison.model)
    axes = {
        axis: forecast_axis(data, comparison, planned, axis, question.catalogue) for axis in comparison.designs
    }  # fmt: skip
    rng = np.random.default_rng(seed)
    p = question.probabilities
    gained, weights, one, wrong, behind = [], [], 0.0, 0.0, {}
    for h, probability in enumerate(p.tolist()):
        n = max(MIN_DRAWS, round(DRAWS * probability))
        outcomes = {axis: forecast_of.draw(question.ids[h], n, rng) for axis, forecast_of in axes.items()}
        before_it, after_it = _evidence(question, axes, outcomes, n)
        log_odds = question.log_odds + after_it - before_it
        log_p = log_odds - np.logaddexp.reduce(log_odds, axis=1, keepdims=True)
        of_cause = np.logaddexp.reduce(log_p[:, question.nodes == question.nodes[h]], axis=1)
        before = np.log(p[question.nodes == question.nodes[h]].sum())
        gained.append(np.maximum(of_cause, before - MAX_LOSS) - before)
        weights.append(probability)
        beside_draws = _beside_draws(question, outcomes, after_it)
        alone = [_named_alone(question, axes, outcomes, after_it[k], beside_draws[k], k) for k in range(n)]
        one += probability * float(np.mean([name is not None for name in alone]))
        wrong += probability * float(np.mean([name is not None and name != question.nodes[h] for name in alone]))
        if h == int(np.argmax(p)):
            behind = {
                name: float(np.mean(log_odds[:, k] < log_odds[:, h] - LEAD)) for k, name in enumerate(question.ids)
            }
    means = np.array([float(each.mean()) for each in gained])
    variance = sum(w**2 * float(each.var(ddof=1)) / len(each) for w, each in zip(weights, gained, strict=True))
    distinguished = tuple(name for name, share in behind.items() if share >= USUALLY and name != NOTHING)
    nat = float(np.log(2.0))
    return Forecast(float(p @ means) / nat, float(np.sqrt(variance)) / nat, one, wrong, distinguished)


def _evidence(
    question: OpenQuestion, axes: Mapping[str, AxisForecast], outcomes: Mapping[str, Outcomes], n: int
) -> tuple[Array, NDArray[np.float64]]:
    """Return the log evidence of each hypothesis over all axes, nats: by the first recording (h,), by both (n, h)."""
    before, after = np.zeros(len(question.ids)), np.zeros((n, len(question.ids)))
    for k, name in enumerate(question.ids):
        of_axes = [(axes[axis].evidence_before(name), outcomes[axis].evidence(name)) for axis in axes]
        present = [(old, new) for old, new in of_axes if old is not None and new is not None]
        if present:
            before[k] = on_all_axes_or_one([old for old, _ in present])
            after[:, k] = on_all_axes_or_one([new for _, new in present])
    return before, after


@dataclass(frozen=True)
class _ForeseenPair(Pair):
    """A leader and a rival in one outcome of a planned recording."""

    question: OpenQuestion
    axes: Mapping[str, AxisForecast]
    outcomes: Mapping[str, Outcomes]
    k: int  #: number of the outcome
    signal: Mapping[str, Fitted]  #: of the leader, by axis

    @cached_property
    def _reproduced(self) -> list[tuple[float, int]]:
        """The part of the signal on each axis, in chi2, that the rival reproduces, and its further directions."""
        return [
            self.axes[axis].reproduced(each, self.rival.id, self.outcomes[axis], self.k)
            for axis, each in self.signal.items()
        ]

    @property
    def share(self) -> float:
        return sum(part for part, _ in self._reproduced) / self.leader_gain

    @property
    def further_directions(self) -> int:
        return sum(more for _, more in self._reproduced)

    @property
    def further_gain(self) -> float:
        of_rival = (each.fitted(self.rival.id, self.k) for each in self.outcomes.values())
        return sum(each.size for each in of_rival if each is not None) - self.leader_gain

    @property
    def further_nats(self) -> float:
        return sum(
            self.axes[axis].further_nats(each, self.rival.id, self.outcomes[axis], self.k)
            for axis, each in self.signal.items()
        )

    @property
    def has_as_simple_a_shape(self) -> bool:
        return (self.leader.id, self.rival.id) in self.question.simple

    @property
    def share_by_draws(self) -> float:
        fixed, drawn = (self.rival, self.leader) if is_drawn(self.leader) else (self.leader, self.rival)
        of_axes = {axis: each.fitted(fixed.id, self.k) for axis, each in self.outcomes.items()}
        signal = {axis: each for axis, each in of_axes.items() if each is not None}
        whole = sum(each.size for each in signal.values())
        parts = (
            self.axes[axis].reproduced_by_draws(each, drawn.id, self.outcomes[axis], self.k)
            for axis, each in signal.items()
        )
        return sum(parts) / whole if whole > 0 else 0.0


def _named_alone(
    question: OpenQuestion, axes: Mapping[str, AxisForecast], outcomes: Mapping[str, Outcomes],
    log_bf: Array, beside_draws: Array, k: int,
) -> int | None:  # fmt: skip
    """Return the number of the cause that the verdict names alone in outcome `k`; None where it names none, or more.

    `log_bf` and `beside_draws` (h,) are the evidence of each hypothesis there, nats.
    """
    h = int(np.argmax(log_bf))
    if log_bf[h] < ENOUGH:
        return None
    leader = question.candidates[h]
    on_axes = {axis: outcomes[axis].fitted(leader.id, k) for axis in axes}
    signal = {axis: each for axis, each in on_axes.items() if each is not None}
    gain = sum(each.size for each in signal.values())
    if gain <= 0:
        return None
    of_candidates = {False: log_bf, True: beside_draws}
    same_prior = (of_candidates[is_size_averaged(leader, rival)] for rival in question.candidates)
    rivals = (
        _ForeseenPair(leader, rival, float(nats[h]), float(nats[j]), gain, question, axes, outcomes, k, signal)
        for j, (rival, nats) in enumerate(zip(question.candidates, same_prior, strict=True))
        if question.nodes[j] != question.nodes[h] and rival.id != NOTHING
    )  # fmt: skip
    return None if any(map(cannot_be_distinguished, rivals)) else int(question.nodes[h])


def _beside_draws(
    question: OpenQuestion, outcomes: Mapping[str, Outcomes], log_bf: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the evidence of hypotheses, (n, h) nats, with the prior of their size with which draws compete.

    `log_bf` (n, h) is that with their own priors; the two are the same for draws.
    """
    beside = log_bf.copy()
    if not any(map(is_drawn, question.candidates)):
        return beside
    for j, candidate in enumerate(question.candidates):
        of_axes = [each.evidence_of_sizes(candidate.id) for each in outcomes.values()]
        present = [nats for nats in of_axes if nats is not None]
        if present and not is_drawn(candidate):
            beside[:, j] = on_all_axes_or_one(present)
    return beside
