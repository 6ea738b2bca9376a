"""Separation: the chi2 by which a rival would fail to explain a leading effect's signal on another schedule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from labctl.fitting.criticism.evidence.gains import reproduced, solve_option
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.verdict import LEAD
from labctl.fitting.criticism.visibility import Schedule
from labctl.fitting.effects import Term
from labctl.fitting.numeric.arrays import Array

#: A schedule separates two effects when one fails to explain the other's signal by more than this chi2.
SEPARATED_CHI2 = LEAD


@dataclass(frozen=True)
class LeadingSignal:
    """The signal of a leading effect as it was found in a recording."""

    term: Term
    coefficients: Mapping[str, Array]  #: axis -> (k,)


def leading_signal(comparison: Comparison, effect_id: str) -> LeadingSignal:
    """Return the signal of an effect of the comparison, in the shape that fits best."""
    leader = next(c for c in comparison.candidates if c.id == effect_id and not c.smooth)
    assert leader.term is not None
    return LeadingSignal(
        leader.term,
        {
            axis: solve_option(comparison.axes[axis].best, comparison.axes[axis].slices[index])[0]
            for axis, index in leader.option.items()
        },
    )


def separation_chi2(
    schedule: Schedule, signal: LeadingSignal, rival: str, floor_dps: Mapping[str, float] | None = None
) -> float:
    """Return the chi2, summed over the axes, that a rival effect leaves of a signal on a schedule.

    `floor_dps` is the noise of a mean by axis, deg/s, as it was found; where it is larger than the schedule's own, it
    counts.
    """
    total = 0.0
    for axis, values in signal.coefficients.items():
        if axis not in schedule.designs:
            continue
        options = schedule.options(axis)
        candidates = [
            (_shape_distance(option.term, signal.term), option_rows)
            for option, option_rows in options
            if option.candidate == signal.term.effect and option_rows.stop - option_rows.start == len(values)
        ]
        if not candidates:
            continue
        _, nearest = min(candidates, key=lambda pair: pair[0])
        eliminated = schedule.left[axis]
        size = float(values @ eliminated.gram[nearest, nearest] @ values)
        shared = max(
            (
                reproduced(eliminated, nearest, values, option_rows)
                for option, option_rows in options
                if option.candidate == rival
            ),
            default=0.0,
        )
        total += max(size - shared, 0.0) * _noise_ratio(schedule, axis, (floor_dps or {}).get(axis, 0.0))
    return total


def _noise_ratio(schedule: Schedule, axis: str, floor_dps: float) -> float:
    """Return the variance of a mean on a schedule over that which was found, at most 1."""
    white = schedule.data.white_var
    variance = schedule.left[axis].noise.size_dps ** 2 + (float(np.median(white[axis])) if white is not None else 0.0)
    return min(1.0, variance / floor_dps**2) if floor_dps > 0 else 1.0


def separation_power(chi2: float) -> float:
    """Return the probability that an experiment with this separation decides between the two effects, 0 to 1."""
    return float(ndtr((chi2 / 2 - SEPARATED_CHI2) / np.sqrt(chi2)))


def _shape_distance(term: Term | None, leader: Term) -> float:
    """Return the distance of a shape of the grid from a refined one: sum of log ratios of the parameters."""
    if term is None or term.order != leader.order or set(term.parameters) != set(leader.parameters):
        return np.inf
    return sum(
        abs(float(np.log((term.parameters[name] + 1e-9) / (leader.parameters[name] + 1e-9))))
        for name in leader.parameters
    )
