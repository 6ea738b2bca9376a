"""Plausibility of a fitted size: the prior that a technology's spans put on the coefficients of an effect."""

from __future__ import annotations

import numpy as np

from labctl.fitting.criticism.candidate_shape import CandidateShape
from labctl.fitting.criticism.evidence.bayes_factors import AxisEvidence
from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.numeric.arrays import Array

#: The size of a coefficient counts as its estimate less this many standard uncertainties.
SPARE_U = 2.0
#: A coefficient this many times its technology's span is not physical.
FARTHEST = 100.0
#: Largest physical coefficient by its unit, whatever the technology: an error of many times the rate itself is not
#: physical.
LARGEST = {"1": 3.0}
#: Evidence on an axis, nats, from which on the size on that axis counts.
SUPPORTED = 2.0


def log_size_prior(option: CandidateShape, found: AxisEvidence, index: int, technology: str) -> float:
    """Return the log prior, nats <= 0, of the size that an option is fitted with; -inf where it is not physical.

    The prior is flat inside the span of plausible sizes of `technology` and falls as its inverse beyond; where the
    technology is not known, that of the largest sizes counts. The largest coefficient in the unit of the first is
    taken: an effect of three axes has one for each. A size that is not significant is plausible.
    """
    if option.term is None or option.term.effect not in CATALOGUE or found.log_bf[index] < SUPPORTED:
        return 0.0
    values, covariance = solve_option(found.best, found.slices[index])
    least = np.maximum(np.abs(values) - SPARE_U * np.sqrt(np.maximum(np.diag(covariance), 0.0)), 0.0)
    if _is_beyond_all(option, least) or _has_wrong_sign(option, float(values[0]), float(least[0]), technology):
        return -np.inf
    size = float(max(s for s, unit in zip(least, option.units, strict=True) if unit == option.units[0]))
    largest = largest_plausible(option.term.effect, technology)
    if largest is None or not size > 0:
        return 0.0
    if size > FARTHEST * largest:
        return -np.inf
    return -float(np.log(max(size / largest, 1.0)))


def largest_plausible(effect_id: str, technology: str) -> float | None:
    """Return the largest plausible first coefficient of an effect, in its unit; None where no range is known.

    Of an unknown `technology` ("") the largest of all.
    """
    ranges = CATALOGUE[effect_id].ranges
    spans = [ranges[technology]] if technology in ranges else [] if technology else list(ranges.values())
    return max((max(abs(low), abs(high)) for low, high in spans), default=None)


def _has_wrong_sign(option: CandidateShape, value: float, least: float, technology: str) -> bool:
    """Return whether a coefficient is clearly of a sign that its effect cannot have: more output beyond a knee."""
    kind = CATALOGUE[option.term.effect] if option.term is not None else None
    if kind is None or not kind.one_sign or technology not in kind.ranges or not least > 0:
        return False
    low, high = kind.ranges[technology]
    return (value < 0 <= low) or (value > 0 >= high)


def _is_beyond_all(option: CandidateShape, least: Array) -> bool:
    return any(size > LARGEST.get(unit, np.inf) for size, unit in zip(least, option.units, strict=True))
