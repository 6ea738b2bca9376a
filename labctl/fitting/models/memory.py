"""What a unit remembers of its temperature, sample by sample: the state that a lag and a hysteresis need in use.

A fit knows the temperature of the whole recording. In use there is the sample of now, and one number for each follower:
a lagging element is moved exactly as a first-order element is by a temperature that goes straight from the last sample
to this one, whatever lies between them in time; a play is carried along only at its edges.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.data.temperature.history import LoggedColumns, TemperatureHistory, rounded_plays
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.effects.thermal_lag import Lag, LagElement, Part, ScaleFactorLag, lag_elements
from labctl.fitting.models.fitted_model import FittedModel, without
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.following import Steps

if TYPE_CHECKING:
    from labctl.answers.fitted_model import StateJson
    from labctl.answers.json_object import JsonObject

#: What `Follower.to_json` describes.
STATE_EQUATION = (
    "each element has a temperature at_c, at first that of the unit; a lag moves by d at_c / dt = (T - at_c) / tau, "
    "tau = cooling_tau_s while at_c > T, else tau_s, and adds size * (at_c - T) to the output of each axis, deg/s, or "
    "if it is_curved size * ((at_c - reference_c)^2 - (T - reference_c)^2); a play moves only to stay within "
    "width_k / 2 of T and adds size * (T - at_c) / (width_k / 2), with bow_c = [low, high] times 4 q (1 - q), "
    "q = (T - low) / (high - low) from 0 to 1"
)
#: What is added where an element has a `scale`.
SCALE_EQUATION = "; the difference of a lag times its scale is added to the scale factor of each axis, so that {law}"
LAWS = {
    "rate": "the output is what the rest of the model gives, plus bias and scale * difference * rate",
    "output": "scale * difference * output is subtracted with the rest of the errors",
}
#: Samples that are followed at once, so that they stay in the processor's cache.
BLOCK = 16384


@dataclass(frozen=True)
class Follower:
    """One element that follows the temperature, and the error that is due to its distance from the temperature."""

    kind: Literal["lag", "play"]
    parameter: float  #: time constant, s, or width, K
    #: Of a lag: the time constant while the element is warmer than the thermometer, s; None: the same.
    cooling_s: float | None
    size: Array  #: (axes,) error, deg/s: of a lag for each K behind (K2 where it is curved), of a play at its edge
    bow: tuple[float, float] | None = None  #: lowest and highest temperature, deg C, where the size goes to 0
    part: Part = "all"  #: what of a lag makes the error
    reference_c: float = 0.0  #: of a curved lag: the temperature that the squares are taken about, deg C
    scale: Array | None = None  #: (axes,) of a lag of the scale factor: its error, 1, in place of deg/s; None: none

    def to_json(self) -> JsonObject:
        """Return what a program needs that follows the temperature itself, as JSON."""
        if self.kind == "play":
            bow = list(self.bow) if self.bow else None
            return {"kind": "play", "width_k": self.parameter, "bow_c": bow, "size": self.size.tolist()}
        return {
            "kind": "lag", "tau_s": self.parameter, "cooling_tau_s": self.cooling_s or self.parameter,
            "is_curved": self.part == "curved", "reference_c": self.reference_c, "size": self.size.tolist(),
            **({} if self.scale is None else {"scale": self.scale.tolist()}),
        }  # fmt: skip

    @property
    def movement(self) -> tuple[str, float, float | None]:
        """What determines where it is: two that agree in this are always at the same place."""
        return self.kind, self.parameter, self.cooling_s

    def place(self, at_c: float, now_c: float) -> float:
        """Return what is kept from sample to sample: of a lag how far it is behind, K, of a play where it is, deg C."""
        return at_c - now_c if self.kind == "lag" else at_c

    def at_c(self, place: float, now_c: float) -> float:
        """Return where it is, deg C, by what is kept of it."""
        return now_c + place if self.kind == "lag" else place

    def moved(self, steps: Steps, place: float) -> Array:
        """Return its place after each step, (n,), from `place`."""
        if self.kind == "play":
            return steps.played(self.parameter, place)
        if self.cooling_s is None:
            return steps.lagged(self.parameter, place)
        return steps.lagged_two_ways(self.parameter, self.cooling_s, place)

    def state(self, places: Array, now_c: Array) -> Array:
        """Return what the size is multiplied by, (n,): K behind the temperature, or the side of the play, -1 to 1."""
        if self.kind == "lag":
            if self.part == "all":
                return places
            return LagElement("", "", self.part, self.parameter).values(places, now_c - self.reference_c)
        side = (now_c - places) / (self.parameter / 2)
        if self.bow is None:
            return side
        share = np.clip((now_c - self.bow[0]) / max(self.bow[1] - self.bow[0], 1e-9), 0.0, 1.0)
        return np.asarray(side * 4 * share * (1 - share))


@dataclass(frozen=True)
class Remembered:
    """What the temperatures before add to samples: to the bias, and to the scale factor."""

    bias_dps: Array  #: (n, axes) deg/s
    scale: Array | None = None  #: (n, axes), times the rate, or times the output of a direct law; None: nothing

    def with_bias(self, bias_dps: Array) -> Remembered:
        """Return the same with more of the bias, (n, axes) deg/s."""
        return Remembered(self.bias_dps + bias_dps, self.scale)


@dataclass(frozen=True)
class Memory:
    """The part of a model that remembers."""

    part: FittedModel
    axes: tuple[str, ...]

    @cached_property
    def followers(self) -> list[Follower]:
        """The elements that follow the temperature, in the order of the model's effects."""
        return [follower for term in self.part.model.terms for follower in self._of(term)]

    def _of(self, term: Term) -> list[Follower]:
        if isinstance(kind_of(term), Lag):
            return self._lags(term)
        size = np.array([self._size(term.effect, axis, "leg") for axis in self.axes])
        width_k = term.parameters.get("width_k", 3.0)
        bow = None
        if term.parameters.get("bowed", 0.0):
            bow = (term.parameters.get("low_c", 0.0), term.parameters.get("high_c", 1.0))
        if term.parameters.get("rounded", 0.0):
            return [Follower("play", width, None, share * size, bow) for width, share in rounded_plays(width_k)]
        return [Follower("play", width_k, None, size, bow)]

    def _lags(self, term: Term) -> list[Follower]:
        """Return the elements of a lag; axes that share a time constant share an element."""
        sizes: dict[tuple[float, float | None, Part], Array] = {}
        for k, axis in enumerate(self.axes):
            for element in lag_elements(term, axis):
                of_axes = sizes.setdefault(
                    (element.tau_s, element.cooling_tau_s, element.part), np.zeros(len(self.axes))
                )
                of_axes[k] += self._size(term.effect, axis, element.column)
        about, none = self.part.model.reference.temperature_c, np.zeros(len(self.axes))
        of_scale = term.effect == ScaleFactorLag.id
        return [
            Follower(
                "lag", tau_s, cooling_s, none if of_scale else size, None, part, about if part == "curved" else 0.0,
                size if of_scale else None,
            )
            for (tau_s, cooling_s, part), size in sizes.items()
        ]  # fmt: skip

    def _size(self, effect: str, axis: str, column: str) -> float:
        fit = self.part.axes[axis]
        owned = (k for k, (owner, name) in enumerate(zip(fit.effects, fit.names, strict=True)) if owner == effect)
        return next((float(fit.values[k, 0]) for k in owned if fit.names[k] == column), 0.0)

    @property
    def has_scale(self) -> bool:
        """Whether a part of the error grows with the rate."""
        return any(follower.scale is not None for follower in self.followers)

    def of_history(self, history: TemperatureHistory, columns: LoggedColumns) -> Remembered:
        """Return the errors of each row, (n, axes), of a recording whose history is known."""
        n = len(next(iter(columns.values())))
        still, turning = (self._at(history, columns, np.full(n, rate)) for rate in (0.0, 1.0))
        return Remembered(still, turning - still if self.has_scale else None)

    def _at(self, history: TemperatureHistory, columns: LoggedColumns, rate_dps: Array) -> Array:
        channels = Channels(dict(columns), dict.fromkeys(BODY_AXES, rate_dps), history)
        return np.column_stack([self.part.error_dps(channels, axis) for axis in self.axes])


@dataclass(frozen=True)
class MemoryState:
    """Where the followers of a unit are: what one process hands over to the next."""

    t_s: float  #: time of the last sample, s
    temperature_c: float  #: its temperature, deg C
    at_c: tuple[float, ...]  #: of each follower, deg C


class RunningMemory:
    """The followers of a unit in use: where each of them is. The first sample finds them at its temperature."""

    def __init__(self, memory: Memory) -> None:
        self._followers = memory.followers
        self._axes = len(memory.axes)
        #: (followers, axes) of the bias, and beside them where there are any those of the scale factor.
        self._sizes = np.array([follower.size for follower in self._followers])
        if memory.has_scale:
            none = np.zeros(self._axes)
            scales = [none if follower.scale is None else follower.scale for follower in self._followers]
            self._sizes = np.concatenate([self._sizes, np.array(scales)], axis=1)
        #: Time, s, and temperature, deg C, of the last sample, and the place of each follower; None before the first.
        self._last: tuple[float, float, tuple[float, ...]] | None = None

    @property
    def state(self) -> MemoryState | None:
        """Where the followers are; None before the first sample."""
        if self._last is None:
            return None
        t_s, temperature_c, places = self._last
        at_c = (follower.at_c(place, temperature_c) for follower, place in zip(self._followers, places, strict=True))
        return MemoryState(t_s, temperature_c, tuple(at_c))

    def reset(self) -> None:
        """Clear the history, as after the unit was switched off for long."""
        self._last = None

    def start(self, state: MemoryState) -> None:
        """Go on from a state that another process has handed over; raises BadInput for one of another calibration."""
        values = (state.t_s, state.temperature_c, *state.at_c)
        if len(state.at_c) != len(self._followers) or not np.all(np.isfinite(values)):
            raise BadInput(
                f"state with {len(state.at_c)} followers at {list(state.at_c)} deg C, t_s = {state.t_s:g} s, "
                f"temperature {state.temperature_c:g} deg C: this calibration has {len(self._followers)} followers, "
                "and all values must be finite; hand over the `state` of a compensator of the same calibration"
            )
        temperature_c = state.temperature_c
        places = (
            follower.place(at_c, temperature_c) for follower, at_c in zip(self._followers, state.at_c, strict=True)
        )
        self._last = state.t_s, temperature_c, tuple(places)

    @property
    def last_s(self) -> float | None:
        """The time of the last sample, s; None before the first."""
        return self._last[0] if self._last is not None else None

    def errors(self, t_s: Array, temperature_c: Array) -> Remembered:
        """Return the errors at samples (n,) in order of time, (n, axes) each, and move on to the last of them.

        A sample that is no number moves nothing.
        """
        errors_dps = np.empty((len(t_s), self._sizes.shape[1]))
        for begin in range(0, len(t_s), BLOCK):
            block = slice(begin, begin + BLOCK)
            self._block(t_s[block], temperature_c[block], errors_dps[block])
        if errors_dps.shape[1] == self._axes:
            return Remembered(errors_dps)
        return Remembered(errors_dps[:, : self._axes], errors_dps[:, self._axes :])

    def _block(self, t_s: Array, temperature_c: Array, errors: Array) -> None:
        """Write the errors of some samples into `errors`."""
        is_finite = np.isfinite(t_s)
        is_finite &= np.isfinite(temperature_c)
        if is_finite.all():
            self._known_block(t_s, temperature_c, errors)
            return
        errors[:] = np.nan
        if is_finite.any():
            of_known = np.empty((int(is_finite.sum()), errors.shape[1]))
            self._known_block(t_s[is_finite], temperature_c[is_finite], of_known)
            errors[is_finite] = of_known

    def _known_block(self, t_s: Array, temperature_c: Array, errors: Array) -> None:
        if self._last is None:
            self.start(
                MemoryState(float(t_s[0]), float(temperature_c[0]), (float(temperature_c[0]),) * len(self._followers))
            )
        assert self._last is not None
        last_s, last_c, places = self._last
        steps = Steps.of(t_s, temperature_c, last_s, last_c)
        moved: dict[tuple[str, float, float | None], Array] = {}
        rows = []
        for follower, place in zip(self._followers, places, strict=True):
            movement = follower.movement
            if movement not in moved:
                moved[movement] = follower.moved(steps, place)
            rows.append(follower.state(moved[movement], temperature_c))
        ends = tuple(float(moved[follower.movement][-1]) for follower in self._followers)
        self._last = float(t_s[-1]), float(temperature_c[-1]), ends
        if self._sizes.shape == (1, 1):  # a product of matrices would cost as much as the state
            np.multiply(rows[0], self._sizes[0, 0], out=errors[:, 0])
        else:
            np.matmul(np.array(rows).T, self._sizes, out=errors)


def check_order(running: RunningMemory, t_s: Array) -> None:
    """Raise BadInput for samples at times (n,) s that go back, or are from before the last one that was followed."""
    last = running.last_s
    goes_on = len(t_s) == 0 or last is None or bool(t_s[0] >= last)
    if goes_on and np.all(t_s[1:] >= t_s[:-1]):
        return
    rows = np.flatnonzero(np.isfinite(t_s))  # one that is no number is left out
    row_times_s = t_s[rows]
    before = np.concatenate([row_times_s[:1] if last is None else [last], row_times_s[:-1]])
    if np.any(back := row_times_s < before):
        k = int(np.argmax(back))
        raise BadInput(
            f"sample {rows[k] + 1}: t_s = {row_times_s[k]:.9g} s is before {before[k]:.9g} s; give them in order of "
            "time"
        )


def split_memory(fitted: FittedModel, axes: tuple[str, ...]) -> tuple[FittedModel, Memory | None]:
    """Return a model without what remembers, and that part; None where nothing of it does.

    Of the part, what is the same at every rate is taken off the output before the rest is solved for the rate; what
    grows with the rate is solved with the rest (`with_scale`).
    """
    remembering = [term.effect for term in fitted.model.terms if kind_of(term).remembers]
    if not remembering:
        return fitted, None
    without_memory, part = fitted, fitted
    for effect in fitted.model.effect_ids:
        if effect in remembering:
            without_memory = without(without_memory, effect)
        else:
            part = without(part, effect)
    return without_memory, Memory(part, axes)


def state_json(fitted: FittedModel) -> StateJson | None:
    """Return what a correction by a model keeps from sample to sample, as JSON; None where it keeps nothing."""
    _, memory = split_memory(fitted, tuple(fitted.axes))
    if memory is None:
        return None
    more = SCALE_EQUATION.format(law=LAWS[fitted.model.argument]) if memory.has_scale else ""
    return {"equation": STATE_EQUATION + more, "elements": [follower.to_json() for follower in memory.followers]}
