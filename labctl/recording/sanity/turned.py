"""Turns by a known angle: whether the integral of the output gives the stated angle, and with which uncertainty."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.motions.turns import USUAL_U_DEG
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.summary import Summary

#: Tolerance, as a share of the angle: beside two more turns of its axis, beside turns of other axes, and alone.
OFF_SAME, OFF_OTHERS, OFF_ALONE = 0.05, 0.1, 0.15
#: The tolerance is at least this many standard uncertainties of the angle.
UNCERTAINTIES = 5.0
#: From this deviation on, as a share, a turn is certainly not the stated one, where other turns show the ratio.
CERTAIN_SHARE = 0.1
#: Turns of one axis that are enough to know its ratio, and turns of any axes.
ENOUGH, PAIR = 3, 2
#: A lone turn whose ratio is outside of this range has another unit rather than another angle; the gain says which.
UNIT_SHARE = (0.5, 2.0)


@dataclass(frozen=True)
class OffTurn:
    """A turn whose integral differs from the stated angle."""

    row: int  #: of the summary
    said_deg: float
    came_deg: float
    tolerance_deg: float
    certain: bool


def is_turned(summary: Summary) -> NDArray[np.bool_]:
    """Return which data sets, (m,), are turns by a known angle; none in a recording of another motion."""
    if summary.info.motion != "turns" or len(summary) == 0:
        return np.zeros(len(summary), dtype=bool)
    return np.asarray(summary["turn_deg"]) != 0


def off_turns(summary: Summary) -> list[OffTurn]:
    """Return the turns whose integral is far from their angle, by the other turns' ratio of the two."""
    is_turn = is_turned(summary)
    if not is_turn.any():
        return []
    turn, u_deg = (np.asarray(summary[name], dtype=np.float64) for name in ("turn_deg", "turn_u_deg"))
    ratio = _ratios(summary, is_turn)
    axis = np.char.lstrip(np.asarray(summary["position"]).astype(np.str_), "-")
    turns = []
    for row in np.flatnonzero(np.isfinite(ratio)):
        expected, allowed = _expected(ratio, axis, int(row))
        if expected is None:
            continue
        share = ratio[row] / expected
        tolerance = max(allowed, UNCERTAINTIES * u_deg[row] / abs(turn[row]))
        if abs(share - 1) > tolerance:
            certain = allowed < OFF_ALONE and abs(share - 1) > CERTAIN_SHARE
            stated_deg = float(turn[row])
            turns.append(OffTurn(int(row), stated_deg, float(share) * stated_deg, tolerance * abs(stated_deg), certain))
    return turns


def _ratios(summary: Summary, is_turn: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the integral of each turn over its stated angle, (m,); NaN at rest and where its axis has no output."""
    position = np.asarray(summary["position"]).astype(np.str_)
    turn, duration_s = (np.asarray(summary[name], dtype=np.float64) for name in ("turn_deg", "duration_s"))
    ratios = np.full(len(summary), np.nan)
    for axis in summary.info.axes:
        mean = summary.of_axis("mean", axis)
        for up_axis, sign in ((axis, 1.0), (f"-{axis}", -1.0)):
            rows = is_turn & (position == up_axis)
            rests = ~is_turn & (position == up_axis) if np.any(~is_turn & (position == up_axis)) else ~is_turn
            bias = float(np.median(mean[rests])) if rests.any() else 0.0
            ratios[rows] = (mean[rows] - bias) * duration_s[rows] / (sign * turn[rows])
    return ratios


def _expected(ratio: NDArray[np.float64], axis: NDArray[np.str_], row: int) -> tuple[float, float] | tuple[None, float]:
    """Return the ratio that a turn should have, and by which share it may be off."""
    is_finite = np.isfinite(ratio)
    same = ratio[is_finite & (axis == axis[row])]
    if len(same) >= ENOUGH:
        return _consensus(same), OFF_SAME
    if is_finite.sum() >= PAIR:
        return _consensus(ratio[is_finite]), OFF_OTHERS
    return (1.0, OFF_ALONE) if UNIT_SHARE[0] <= abs(ratio[row]) <= UNIT_SHARE[1] else (None, OFF_ALONE)


def _consensus(ratios: NDArray[np.float64]) -> float:
    """Return the median of the largest group of ratios (n,) that agree; that of a gyro in its unit, 1, has a vote."""
    votes = np.append(1.0, ratios)
    near = np.abs(votes[None, :] - votes[:, None]) <= OFF_OTHERS * np.abs(votes[:, None])
    group = near[int(np.argmax(near.sum(axis=1)))][1:]
    return float(np.median(ratios[group])) if group.any() else 1.0


def check_turned(summary: Summary, turns: list[OffTurn]) -> Iterator[Finding]:
    """Yield the turns whose integral differs from the stated angle, and uncertainties that are not stated."""
    for turn in turns:
        number, position = summary["dataset"][turn.row], summary["position"][turn.row]
        yield Finding(
            "turn", "certain" if turn.certain else "likely", f"data set {number}, axis {str(position).lstrip('-')}",
            turn_in_words(turn), turn.came_deg, "deg", f"{turn.said_deg:g} +- {turn.tolerance_deg:.2g} deg",
            what_to_do(turn),
        )  # fmt: skip
    if is_turned(summary).any() and not bool(np.all(summary["turn_u_known"])):
        yield Finding(
            "turn_uncertainty", "likely", "column turn_u_deg",
            f"the column is missing, so {USUAL_U_DEG:g} deg is used for every turn", USUAL_U_DEG, "deg",
            "the standard uncertainty of each turn", "add the column: the uncertainty of the scale factor depends on "
                "it",
        )  # fmt: skip


def turn_in_words(turn: OffTurn) -> str:
    """Return the integral of a turn, in words."""
    came = round(turn.came_deg)
    only = "only " if 0 <= turn.came_deg / turn.said_deg < 1 else ""
    return f"the integral of the output is {only}{came:d} deg instead of {turn.said_deg:g} deg"


def what_to_do(turn: OffTurn) -> str:
    """Return what to do about a turn whose integral differs from the stated angle."""
    if turn.came_deg * turn.said_deg < 0:
        return "correct the sign of turn_deg or of the position, or turn again"
    return "repeat the turn, or correct turn_deg"
