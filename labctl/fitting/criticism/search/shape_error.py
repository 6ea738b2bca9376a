"""Whether the leader beside the effects that were found is another cause, or what their wrong shape leaves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.criticism.evidence.gains import solve_option
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate, are_exact
from labctl.fitting.criticism.verdict import ALIKE, Step, is_at_end, overlap
from labctl.fitting.effects import CATALOGUE

#: The next effect is only named when its evidence, where it does most, is at least this share of the evidence for the
#: one before: less is the residue of a wrong shape of the one before.
NEXT_SHARE = 0.04
#: The same after effects that could not be distinguished: one of the others may fit better than the one that was added.
NEXT_SHARE_AMBIGUOUS = 0.08
#: Least share of an effect that is assumed within data sets, and between them.
LEAST_PART = 0.05


def is_shape_error(before: Comparison, named: Step, after: Comparison, step: Step) -> bool:
    """Return whether the new leader may be the residue of a wrong shape of the effect that was just added.

    The two are compared where the new leader is largest, within data sets or between them: the wrong shape of a wave
    within data sets leaves waves, and hardly anything between them. Beside an effect of the temperature, another one
    of which the shortest time constant fits best is the delay of the first.
    """
    if step.leader is None or named.leader is None or are_exact(step.leader, named.leader):
        return False
    both = all(leader.id in CATALOGUE and CATALOGUE[leader.id].by_temperature for leader in (named.leader, step.leader))
    if both and is_at_end(after, step.leader, shortest=True):
        return True
    least = NEXT_SHARE if _are_one(before, named) else NEXT_SHARE_AMBIGUOUS
    of_new, of_old = _within_and_between(after, step.leader), _within_and_between(before, named.leader)
    there = int(np.argmax(of_new))
    could = max(float(of_old[there]), LEAST_PART) * named.leader.log_bf
    return bool(of_new[there] * step.leader.log_bf < least * could)


def _are_one(comparison: Comparison, named: Step) -> bool:
    """Return whether a group is one effect, or several that each reproduce the leader's signal."""
    others = [c for c in comparison.candidates if not c.smooth and c.id in named.group[1:]]
    return all(overlap(comparison, named.leader, other) > ALIKE for other in others) if named.leader else False


def _within_and_between(comparison: Comparison, candidate: Candidate) -> NDArray[np.float64]:
    """Return the shares of a candidate's signal beside the base that lie within data sets, and between them."""
    total = np.zeros(2)
    for axis, index in candidate.option.items():
        design, found = comparison.designs[axis], comparison.axes[axis]
        values, _ = solve_option(found.best, found.slices[index])
        scale = comparison.scales[axis].copy()
        scale[0] = np.sqrt(comparison.white_var[axis] + found.best.noise.size_dps**2)
        kept = design.present
        base, signal = (rows[kept] / scale[kept][:, None] for rows in (design.base, design.options[index].rows))
        size = np.maximum(np.linalg.norm(base, axis=0), 1e-300)
        taken, *_ = np.linalg.lstsq(base / size, signal @ values, rcond=1e-9)
        left = np.zeros(kept.shape)
        left[kept] = signal @ values - base / size @ taken
        total += (np.sum(left[1:] ** 2), np.sum(left[0] ** 2))
    return np.asarray(total / max(float(total.sum()), 1e-300))
