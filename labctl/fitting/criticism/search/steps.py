"""A step in time, its place refined: sharp, anywhere in a campaign, of the bias or of the scale factor.

The grid's steps are spread over a share of the campaign and a twentieth of it apart: a sharp one that lies between two
of them, or within a data set, would lose to a candidate that happens to change nearer to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.elimination import ScaledBase, WhitenedBase
from labctl.fitting.criticism.evidence.gains import gains_of
from labctl.fitting.criticism.evidence.noise_grid import Noise
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.verdict import ENOUGH
from labctl.fitting.numeric.arrays import Array

TIME = "t_s"
#: Places that are tried in each round; the next round lies between the neighbours of the best.
PLACES, ROUNDS = 48, 3
#: A step nearer than this share of the campaign to its ends is left out.
EDGE = 0.02
#: From this share of the evidence for the leading effect on, time is searched for a sharp step.
SHARE = 0.5


def may_be_step(comparison: Comparison) -> bool:
    """Return whether time explains so much that a step, sharp and in its place, could explain more than any effect."""
    effect, time = comparison.leader(smooth=False), _time(comparison)
    return effect is not None and time is not None and time.log_bf > SHARE * effect.log_bf


def _time(comparison: Comparison) -> Candidate | None:
    return next((c for c in comparison.candidates if c.smooth and c.id == TIME and c.log_bf >= ENOUGH), None)


def refined_steps(comparison: Comparison) -> dict[str, CandidateShape]:
    """Return axis -> the sharp step in time that removes most chi2 over all axes.

    Nothing where time has no evidence, or the step removes less than the leading effect. All is weighed at white noise:
    beside a model without the step, the step looks like drift and like scatter that grows with the rate.
    """
    time = _time(comparison)
    if time is None:
        return {}
    t_s = np.asarray(comparison.data.nodes[TIME], dtype=np.float64)
    effect = comparison.leader(smooth=False)
    axes = [_Axis(comparison, axis, None if effect is None else effect.option.get(axis)) for axis in time.option]
    low, high = t_s.min() + EDGE * np.ptp(t_s), t_s.max() - EDGE * np.ptp(t_s)
    for _ in range(ROUNDS):
        places = np.linspace(low, high, PLACES)
        gain = np.sum([axis.gains(places) for axis in axes], axis=0)
        is_scaled, at = (int(i) for i in np.unravel_index(int(np.argmax(gain)), gain.shape))
        low, high = places[max(at - 1, 0)], places[min(at + 1, PLACES - 1)]
    if gain[is_scaled, at] < sum(axis.of_effect for axis in axes):
        return {}
    return {axis.name: axis.step(float(places[at]), is_scaled=bool(is_scaled)) for axis in axes}


class _Axis:
    """One axis at white noise, its base ready to be eliminated from steps."""

    def __init__(self, comparison: Comparison, name: str, effect: int | None) -> None:
        self.name, self._data, self._design = name, comparison.data, comparison.designs[name]
        white_var = comparison.data.white_var
        white = comparison.white_var[name] if white_var is None else white_var[name]
        self._scale = comparison.scales[name]
        self._base = WhitenedBase(self._design, white, Noise(0.0, 0.0, 0.0))
        self._y = comparison.data.error_dps(name)[:, :, None]
        #: chi2 that the leading effect removes
        self.of_effect = 0.0
        if effect is not None:
            rows = self._design.options[effect].rows
            self.of_effect = float(self._removed(rows, [slice(0, rows.shape[2])])[0])

    def gains(self, places: Array) -> NDArray[np.float64]:
        """Return the chi2 that a step of the bias (first row) or scale factor removes at each place, (2, n)."""
        rows = self._data.rows_of(self._steps(places))
        return self._removed(rows, [slice(k, k + 1) for k in range(rows.shape[2])]).reshape(2, -1)

    def step(self, place: float, *, is_scaled: bool) -> CandidateShape:
        """Return a step as an option."""
        column = self._steps(np.array([place]))[:, [int(is_scaled)]]
        name, unit_symbol = (f"{TIME}>{place:.6g} x rate", "1") if is_scaled else (f"{TIME}>{place:.6g}", "deg/s")
        return CandidateShape(TIME, None, self._data.rows_of(column), (name,), (unit_symbol,))

    def _steps(self, places: Array) -> NDArray[np.float64]:
        t_s = np.asarray(self._data.nodes[TIME], dtype=np.float64)
        steps = np.where(t_s[:, None] >= places, 0.5, -0.5)
        return np.concatenate([steps, steps * self._data.nodes.rate_dps(self.name)[:, None]], axis=1)

    def _removed(self, rows: NDArray[np.float64], options: list[slice]) -> Array:
        everything = np.concatenate([rows, self._y], axis=2)
        others = ScaledBase(self._design, self._scale).products(everything)
        return gains_of(self._base.eliminate_from(everything[0], others), options)[0]
