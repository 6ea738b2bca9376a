"""What a unit remembers of its temperature, sample by sample: the state that a lag and a hysteresis need in use.

A fit knows the temperature of the whole recording. In use there is the sample of now, and one number for each follower:
a lagging element is moved exactly as a first-order element is by a temperature that goes straight from the last sample
to this one, whatever lies between them in time; a play is carried along only at its edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.temperature.history import LoggedColumns, TemperatureHistory, lag_shares, rounded_plays
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.models.fitted_model import FittedModel, without
from labctl.fitting.numeric.arrays import Array


@dataclass(frozen=True)
class Follower:
    """One element that follows the temperature, and the error that is due to its distance from the temperature."""

    kind: Literal["lag", "play"]
    parameter: float  #: time constant, s, or width, K
    size: Array  #: (axes,) error, deg/s: of a lag for each K behind, of a play at its edge
    bow: tuple[float, float] | None = None  #: lowest and highest temperature, deg C, where the size goes to 0

    def moved(self, at_c: float, before_c: float, now_c: float, step_s: float) -> float:
        """Return where the follower is when the temperature has gone from `before_c` to `now_c` in `step_s`, deg C."""
        if self.kind == "lag":
            keep, last, new = lag_shares(step_s, self.parameter)
            return keep * at_c + last * before_c + new * now_c
        half = self.parameter / 2
        return min(max(at_c, now_c - half), now_c + half)

    def state(self, at_c: float, now_c: float) -> float:
        """Return what the size is multiplied by: K behind the temperature, or the side of the play from -1 to 1."""
        if self.kind == "lag":
            return at_c - now_c
        side = (now_c - at_c) / (self.parameter / 2)
        if self.bow is None:
            return side
        share = min(max((now_c - self.bow[0]) / max(self.bow[1] - self.bow[0], 1e-9), 0.0), 1.0)
        return side * 4 * share * (1 - share)


@dataclass(frozen=True)
class Memory:
    """The part of a model that remembers."""

    part: FittedModel
    axes: tuple[str, ...]

    @property
    def followers(self) -> list[Follower]:
        """The elements that follow the temperature, in the order of the model's effects."""
        return [follower for term in self.part.model.terms for follower in self._of(term)]

    def _of(self, term: Term) -> list[Follower]:
        size = np.array([self._size(term, axis) for axis in self.axes])
        if term.effect == "thermal_lag":
            return [Follower("lag", term.parameters.get("tau_s", 600.0), size)]
        width_k = term.parameters.get("width_k", 3.0)
        bow = None
        if term.parameters.get("bowed", 0.0):
            bow = (term.parameters.get("low_c", 0.0), term.parameters.get("high_c", 1.0))
        if term.parameters.get("rounded", 0.0):
            return [Follower("play", width, share * size, bow) for width, share in rounded_plays(width_k)]
        return [Follower("play", width_k, size, bow)]

    def _size(self, term: Term, axis: str) -> float:
        fit = self.part.axes[axis]
        return float(fit.values[fit.effects.index(term.effect), 0]) if term.effect in fit.effects else 0.0

    def of_history(self, history: TemperatureHistory, columns: LoggedColumns) -> Array:
        """Return the error of each row of a recording whose history is known, (n, axes) deg/s."""
        still = {axis: np.zeros(len(next(iter(columns.values())))) for axis in BODY_AXES}
        channels = Channels(dict(columns), still, history)
        return np.column_stack([self.part.error_dps(channels, axis) for axis in self.axes])


class RunningMemory:
    """The followers of a unit in use: where each of them is. The first sample finds them at its temperature."""

    def __init__(self, memory: Memory) -> None:
        self._followers = memory.followers
        self._none = np.zeros(len(memory.axes))
        self.reset()

    def reset(self) -> None:
        """Forget all, as after the unit was switched off for long."""
        self._at: list[float] = []
        self._t_s, self._now_c = 0.0, 0.0

    @property
    def last_s(self) -> float | None:
        """The time of the last sample, s; None before the first."""
        return self._t_s if self._at else None

    def error_dps(self, t_s: float, temperature_c: float) -> Array:
        """Return the error at a sample, (axes,) deg/s, in order of time; one that is no number moves nothing."""
        if not (np.isfinite(t_s) and np.isfinite(temperature_c)):
            return np.full_like(self._none, np.nan)
        if self._at:
            step = t_s - self._t_s
            self._at = [
                f.moved(at, self._now_c, temperature_c, step) for f, at in zip(self._followers, self._at, strict=True)
            ]
        else:
            self._at = [temperature_c] * len(self._followers)
        self._t_s, self._now_c = t_s, temperature_c
        total = self._none.copy()
        for follower, at in zip(self._followers, self._at, strict=True):
            total += follower.size * follower.state(at, temperature_c)
        return total


def course(running: RunningMemory, t_s: Array, temperature_c: Array) -> Array:
    """Return the error of samples at times (n,) and temperatures (n,), (n, axes) or one for all, (n, axes) deg/s.

    Raises BadInput for times that go back.
    """
    if np.any(np.diff(t_s) < 0):
        row = int(np.argmax(np.diff(t_s) < 0)) + 1
        raise BadInput(
            f"sample {row + 1}: t_s = {t_s[row]:.9g} s is before {t_s[row - 1]:.9g} s; give them in order of time"
        )
    warm = temperature_c.mean(axis=1) if temperature_c.ndim == 2 else np.broadcast_to(temperature_c, t_s.shape)
    return np.array([running.error_dps(t, c) for t, c in zip(t_s.tolist(), warm.tolist(), strict=True)])


def split_memory(fitted: FittedModel, axes: tuple[str, ...]) -> tuple[FittedModel, Memory | None]:
    """Return a model without what remembers, and that part; None where nothing of it does.

    The part is the same at every rate, so that it is taken off the output before the rest is solved for the rate.
    """
    remembering = [term.effect for term in fitted.model.terms if kind_of(term).remembers]
    if not remembering:
        return fitted, None
    rest, part = fitted, fitted
    for effect in fitted.model.effect_ids:
        if effect in remembering:
            rest = without(rest, effect)
        else:
            part = without(part, effect)
    return rest, Memory(part, axes)
