"""A hand that turns the units: how it moves them, how well, and which mistakes it makes first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: What a hand can do wrong: stop after five sixths of the angle, turn about another axis, turn the other way, nudge
#: the units after the turn, turn faster than a gyro can follow, do nothing.
MISTAKES = ("short", "axis", "direction", "nudge", "fast", "nothing")
SHORT_SHARE, NUDGE_DEG, NUDGE_AFTER_S, FAST_DPS = 5.0 / 6.0, 8.0, 3.0, 2000.0
#: Duration of a nudge, s.
NUDGE_S = 0.4
#: Standard deviation of the time between a question and the start of the turn, as a share of `reaction_s`.
REACTION_SPREAD = 0.2


class Motion(Protocol):
    """A motion below the hand, such as that of a table."""

    def angle_deg(self, t_s: Array) -> Array: ...

    def commanded_deg(self, t_s: Array) -> Array: ...


@dataclass(frozen=True)
class _Swing:
    """One movement from rest to rest with the least jerk, as hands do it (Flash and Hogan 1985)."""

    start_s: float
    duration_s: float
    angle_deg: float

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    def at(self, t_s: Array) -> Array:
        """Return how far it has come at times (n,), deg."""
        u = np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)
        return np.asarray(self.angle_deg * u**3 * (10.0 + u * (6.0 * u - 15.0)))


class HandMotion:
    """The angle by which a hand has turned the units about the axis that points up, beside what a table does."""

    def __init__(self, settings: Mapping[str, object], below: Motion | None, seed: Sequence[int]) -> None:
        """Take the settings of [simulation.hand]; raises ValueError for one that is not known."""
        defaults = {"u_deg": 0.5, "rate_dps": 90.0, "reaction_s": 2.0}
        mistakes = settings.get("mistakes", ())
        if wrong := sorted(set(settings) - {*defaults, "mistakes"}):
            raise ValueError(
                f"[simulation] hand.{wrong[0]} is not known; choose one of {', '.join(defaults)}, mistakes"
            )
        if not isinstance(mistakes, list | tuple) or not set(mistakes) <= set(MISTAKES):
            raise ValueError(f"[simulation] hand.mistakes = {mistakes!r}: give a list of {', '.join(MISTAKES)}")
        for name, usual in defaults.items():
            value = settings.get(name, usual)
            if not isinstance(value, int | float) or not (value > 0 or (name == "u_deg" and value == 0)):
                raise ValueError(f"[simulation] hand.{name} = {value!r}; give a number above 0")
            defaults[name] = float(value)
        self._u_deg, self.rate_dps, self.reaction_s = defaults["u_deg"], defaults["rate_dps"], defaults["reaction_s"]
        self._mistakes = [str(each) for each in cast("Sequence[object]", mistakes)]  #: made first, one in each turn
        self._below = below
        self._rng = np.random.default_rng(seed)
        self._swings: list[_Swing] = []
        self._busy_until_s = 0.0

    def turn(self, t_s: float, position: str, turn_deg: float) -> str:
        """Begin a turn that was asked for at a time; returns the axis that is up while it is done."""
        mistake = self._mistakes.pop(0) if self._mistakes else ""
        spread, off = self._rng.standard_normal(2)
        begin_s = t_s + self.reaction_s * max(1.0 + REACTION_SPREAD * float(spread), 0.1)
        angle_deg = turn_deg + self._u_deg * float(off)
        angle_deg *= {"short": SHORT_SHARE, "direction": -1.0, "nothing": 0.0}.get(mistake, 1.0)
        rate_dps = FAST_DPS if mistake == "fast" else self.rate_dps
        swing = _Swing(begin_s, max(abs(angle_deg) / rate_dps, 0.5), angle_deg)
        self._swings.append(swing)
        self._busy_until_s = swing.end_s + 0.5 * self.reaction_s
        if mistake == "nudge":
            self._swings.append(_Swing(self._busy_until_s + NUDGE_AFTER_S, NUDGE_S, NUDGE_DEG))
        if mistake == "axis":
            sign, axis = ("-", position[1:]) if position.startswith("-") else ("", position)
            return sign + "yzx"["xyz".index(axis)]
        return position

    def is_turning(self, t_s: float) -> bool:
        """Return whether the person has yet to say that the turn is done, at a time, s."""
        return t_s < self._busy_until_s

    @property
    def has_turned(self) -> bool:
        """Whether any turn was begun."""
        return bool(self._swings)

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle of the units at times (n,), deg, unwrapped."""
        below = np.zeros(len(t_s)) if self._below is None else self._below.angle_deg(t_s)
        return np.asarray(below + self._by_hand(t_s))

    def commanded_deg(self, t_s: Array) -> Array:
        """Return the commanded angle of the table below plus the true angle of the hand, which has no command, deg."""
        below = np.zeros(len(t_s)) if self._below is None else self._below.commanded_deg(t_s)
        return np.asarray(below + self._by_hand(t_s))

    def _by_hand(self, t_s: Array) -> Array:
        rates = np.zeros(len(t_s))
        if not len(t_s):
            return rates
        first_s, last_s = float(np.min(t_s)), float(np.max(t_s))
        for swing in self._swings:
            if swing.end_s <= first_s:
                rates += swing.angle_deg
            elif swing.start_s < last_s:
                rates += swing.at(t_s)
        return rates
