"""Rivals of the likeliest effect: which of them the data leave beside it.

The rules are those of a verdict on a recording, and of the verdicts that a forecast foresees: `Pair` is what they ask
of a leader and a rival, whether it was measured or is one outcome of a planned recording.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

from scipy.special import chdtrc

from labctl.fitting.criticism.ranking import Candidate, are_exact
from labctl.fitting.effects import CATALOGUE

#: A lead of less than this over another candidate leaves both, nats: about 20 to 1.
LEAD = 3.0
#: A lead from which on the evidence alone decides against a rival with more coefficients, nats.
FAR = 12.0
#: A rival that leaves less than this of the leader's signal (chi2) cannot be distinguished from it ...
INDISTINGUISHABLE_CHI2 = 7.0
#: ... nor one with no more coefficients that reproduces more than this share of it.
ALIKE = 0.995
#: Further coefficients that noise makes so large with less than this probability are not 0.
MIN_CHANCE = 1e-3


@dataclass(frozen=True)
class Pair(ABC):
    """The likeliest effect and a rival of it. What is costly is computed where a rule asks for it."""

    leader: Candidate
    rival: Candidate
    leader_log_bf: float  #: nats, with the same prior of the size as for the rival: `log_bf_beside`
    rival_log_bf: float  #: nats
    leader_gain: float  #: chi2 that the leader removes

    @property
    @abstractmethod
    def share(self) -> float:
        """The share of the leader's signal that the rival reproduces, 0 to 1."""

    @property
    @abstractmethod
    def further_directions(self) -> int:
        """How many more directions the rival has than the leader."""

    @property
    @abstractmethod
    def further_gain(self) -> float:
        """The chi2 that the rival removes beyond the leader."""

    @property
    @abstractmethod
    def further_nats(self) -> float:
        """The evidence against the coefficients that the rival has beyond the leader, nats."""

    @property
    @abstractmethod
    def has_as_simple_a_shape(self) -> bool:
        """Whether a shape of the rival with no more coefficients than the leader is not far behind it."""

    @property
    @abstractmethod
    def share_by_draws(self) -> float:
        """The share of the signal of the one that is not drawn that as few draws of the other reproduce, 0 to 1.

        As few: as many as the one has coefficients on each axis; only asked where one of the two is drawn.
        """

    @cached_property
    def contains_leader(self) -> bool:
        """Whether the rival reproduces the leader's signal up to what noise hides."""
        return (1.0 - self.share) * self.leader_gain < INDISTINGUISHABLE_CHI2


def is_drawn(candidate: Candidate) -> bool:
    """Return whether each coefficient of a candidate is a draw, for a powered run or a mounting of its own."""
    kind = None if candidate.smooth else CATALOGUE.get(candidate.id)
    return kind is not None and kind.is_random


def is_size_averaged(one: Candidate, other: Candidate) -> bool:
    """Return whether the size of both of a pair is averaged over in their odds: where one of the two is drawn.

    Odds between a single size and an average over sizes would come from these priors, and not from the data.
    """
    return is_drawn(one) != is_drawn(other)


def log_bf_beside(candidate: Candidate, other: Candidate) -> float:
    """Return the log Bayes factor of a candidate with the same prior of its size as another one has, nats."""
    return candidate.log_bf + (candidate.size_nats if is_size_averaged(candidate, other) else 0.0)


def are_aliases_by_draws(pair: Pair) -> bool:
    """Return whether one of a pair is drawn, and no more draws than the other has coefficients are its signal.

    One mounting that differs from all others is gravity along an axis that only this mounting turns up, in every
    reading. Beside that, the evidence weighs no data, but how a coefficient and draws are distributed: the pair cannot
    be distinguished whatever the odds, as long as the other draws are not larger than noise makes them.
    """
    if not is_size_averaged(pair.leader, pair.rival) or pair.share_by_draws <= ALIKE:
        return False
    if is_drawn(pair.rival) or pair.further_directions >= 0:
        return True
    return by_chance(-pair.further_gain, -pair.further_directions) >= MIN_CHANCE


def cannot_be_distinguished(pair: Pair) -> bool:
    """Return whether the data leave a rival beside the leader.

    A rival that is the leader with more coefficients is judged by what is known of these: it is out where they are
    next to nothing, by the same odds as any other, `LEAD`, unless it has a shape with no more coefficients than the
    leader that is not far behind. One with a coefficient for each run or mounting stays in as well where noise hardly
    makes them so large, whatever its evidence: the price of so many coefficients hides small shifts.
    """
    near = pair.rival_log_bf > pair.leader_log_bf - LEAD or (pair.rival_log_bf > 0 and _is_indistinguishable(pair))
    return _stays_in(pair, near=near) or are_aliases_by_draws(pair)


def _stays_in(pair: Pair, *, near: bool) -> bool:
    """Return whether the evidence leaves a rival in, which is `near` where it is not far behind or is the leader's
    signal."""
    is_random = is_drawn(pair.rival)
    if not (near or is_random) or pair.further_directions <= 0 or not pair.contains_leader:
        return near
    if is_random:
        return near or by_chance(pair.further_gain, pair.further_directions) < MIN_CHANCE
    return near and (
        pair.further_nats < LEAD or pair.rival_log_bf > pair.leader_log_bf or pair.has_as_simple_a_shape
    )  # fmt: skip


def _is_indistinguishable(pair: Pair) -> bool:
    """Return whether a rival reproduces the leader's signal, without the evidence deciding against it.

    A rival with more coefficients can follow any signal: it only counts while its evidence is not far behind.
    """
    if pair.share > ALIKE and pair.further_directions <= 0 and not are_exact(pair.leader, pair.rival):
        return True
    return pair.rival_log_bf > pair.leader_log_bf - FAR and pair.contains_leader


def by_chance(gain: float, directions: int) -> float:
    """Return the probability that noise removes so much chi2 in so many directions."""
    return float(chdtrc(directions, max(gain, 0.0)))
