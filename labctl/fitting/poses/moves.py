"""Moves: what the gyro gave between two rests that follow each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.readings import AXES, PoseReadings

#: An output is at its rail where so many readings in a row are within this share of the axis' extreme, and the
#: reading before or after them is further off than so many times that and the noise: a smooth peak fades, a
#: clipped one breaks off.
RAIL_SHARE, RAIL_READINGS, RAIL_EDGE = 2e-4, 3, 6.0
#: A turn may take at most so long, s: bias drift would be all that it shows.
LONGEST_S = 120.0


@dataclass(frozen=True)
class Moves:
    """m moves between rests, filled up to the same number n of readings with steps of 0 s."""

    before: NDArray[np.int64]  #: (m,) the rest that a move began in; it ended in the next
    t_s: NDArray[np.float64]  #: (m, 2) start and end
    rate_dps: NDArray[np.float64]  #: (m, n, 3) output, with its bias
    step_s: NDArray[np.float64]  #: (m, n - 1)
    share: NDArray[np.float64]  #: (m, n) how far between the middles of the two rests a reading lies, 0 to 1
    jitter_s: Array  #: (m,) standard deviation of the time stamps about a line
    density: Array  #: (3,) variance of a mean of the gyro over one second, (deg/s)^2 s
    why_not: tuple[str, ...]  #: (m,) why a move cannot be used; "" where it can

    def __len__(self) -> int:
        return len(self.before)

    @cached_property
    def usable(self) -> NDArray[np.bool_]:
        """Which moves can be used, (m,)."""
        return np.array([not reason for reason in self.why_not], dtype=np.bool_)

    @property
    def duration_s(self) -> Array:
        """How long each move took, (m,)."""
        return np.asarray(self.t_s[:, 1] - self.t_s[:, 0])

    def take(self, rows: NDArray[np.bool_]) -> Moves:
        """Return some of the moves, by mask (m,)."""
        return replace(
            self,
            before=self.before[rows],
            t_s=self.t_s[rows],
            rate_dps=self.rate_dps[rows],
            step_s=self.step_s[rows],
            share=self.share[rows],
            jitter_s=self.jitter_s[rows],
            why_not=tuple(reason for reason, keep in zip(self.why_not, rows, strict=True) if keep),
        )


def moves_between(readings: PoseReadings, rests: Rests, gyro_dps: NDArray[np.float64] | None = None) -> Moves:
    """Return the moves of a recording, from the last reading of a rest to the first of the next.

    `gyro_dps` (n, 3) are outputs to take in place of those of the readings: with an error taken off.
    """
    gyro_dps = readings.gyro_dps if gyro_dps is None else gyro_dps
    first, last = rests.end[:-1] - 1, rests.begin[1:]
    n = int((last - first).max(initial=1)) + 1
    m = len(first)
    rate, step, share = np.zeros((m, n, 3)), np.zeros((m, n - 1)), np.zeros((m, n))
    jitter, why_not = np.zeros(m), []
    rails = np.stack([readings.gyro_dps.max(axis=0), readings.gyro_dps.min(axis=0)])
    for k, (begin, end) in enumerate(zip(first, last, strict=True)):
        rows = slice(int(begin), int(end) + 1)
        t_s, length = readings.t_s[rows], int(end - begin) + 1
        reasons = _why_not(readings, rows, rails, rests.noise[3:])
        why_not.append(reasons)
        if reasons:
            continue
        rate[k, :length] = gyro_dps[rows]
        rate[k, length:] = gyro_dps[end]
        step[k, : length - 1] = np.diff(t_s)
        between = (t_s - rests.t_s[k]) / (rests.t_s[k + 1] - rests.t_s[k])
        share[k, :length], share[k, length:] = between, between[-1]
        jitter[k] = _jitter(t_s)
    longest = max((int(np.count_nonzero(row)) for row in step), default=1)  # long ones that are not used need no room
    return Moves(
        np.arange(m),
        np.column_stack([readings.t_s[first], readings.t_s[last]]),
        rate[:, : longest + 1],
        step[:, :longest],
        share[:, : longest + 1],
        jitter,
        rests.density[3:],
        tuple(why_not),
    )


def _why_not(readings: PoseReadings, rows: slice, rails: NDArray[np.float64], noise: Array) -> str:
    t_s = readings.t_s[rows]
    if t_s[-1] - t_s[0] > LONGEST_S:
        return f"lasts {t_s[-1] - t_s[0]:.0f} s without a rest (limit {LONGEST_S:.0f} s)"
    broken = np.flatnonzero(readings.breaks[rows][1:])
    if len(broken):
        gap = t_s[broken[0] + 1] - t_s[broken[0]]
        return f"a gap of {gap:.3g} s in the readings at t_s = {t_s[broken[0]]:.4g}"
    for i, axis in enumerate(AXES):
        for rail in rails[:, i]:
            if _is_clipped(readings.gyro_dps[rows, i], float(rail), float(noise[i])):
                return f"gyro_{axis} is saturated at {rail:.4g} deg/s: turn the unit more slowly"
    return ""


def _is_clipped(output: Array, rail: float, noise_dps: float) -> bool:
    """Return whether an output (n,) stays at its rail and breaks off there."""
    away = np.abs(output - rail)
    near = RAIL_SHARE * abs(rail)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], away <= near, [False]]).astype(np.int8)))
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        beside = max(away[begin - 1] if begin > 0 else 0.0, away[end] if end < len(away) else 0.0)
        if end - begin >= RAIL_READINGS and beside > RAIL_EDGE * (near + noise_dps):
            return True
    return False


def _jitter(t_s: Array) -> float:
    """Return the scatter of time stamps about equal spacing, s."""
    if len(t_s) < 4:
        return 0.0
    index = np.arange(len(t_s), dtype=np.float64)
    line = np.polynomial.Polynomial.fit(index, t_s, 1)
    return float(np.sqrt(np.sum((t_s - line(index)) ** 2) / (len(t_s) - 2)))
