"""Remainder: what named effects do not explain, and whether an effect of a slightly wrong shape explains most."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from labctl.answers.criticism import Remainder
from labctl.fitting.criticism.evidence.bayes_factors import evidence_of
from labctl.fitting.criticism.evidence.design import Design, Discrepancy
from labctl.fitting.criticism.evidence.elimination import eliminate_base
from labctl.fitting.criticism.model_comparison import Comparison, compare_models, designs_beside
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.rivals import LEAD
from labctl.fitting.criticism.verdict import ENOUGH_NEXT, channels_behind
from labctl.fitting.effects import Effect, Term

#: Excess chi2 over its own scatter from which on something is said to remain.
SIGNIFICANT = 5.0
#: From this probability on that noise alone leaves more, what is left is noise, whatever resembles it.
SURELY_NOISE = 0.995


def remainder_of(
    first: Comparison, final: Comparison, terms: tuple[Term, ...], catalogue: Mapping[str, Effect]
) -> Remainder | None:
    """Return what remains beside effects in their present shapes, at the noise beside them; None where it is noise.

    `share` is of the excess chi2 before, `over_floor` the means' RMS over their noise, and `depends_on` the channels
    that it follows.
    """
    model = first.model.with_added(terms)
    designs = {
        axis: replace(design, options=[option for option in design.options if option.smooth])
        for axis, design in designs_beside(first, model, {}).items()
    }
    before = after = freedom = 0.0
    for axis, design in designs.items():
        excess, _ = _excess(first, final, axis, replace(first.designs[axis], options=[]))
        before += max(excess, 0.0)
        excess, number = _excess(first, final, axis, replace(design, options=[]))
        after, freedom = after + excess, freedom + number
    if after < SIGNIFICANT * np.sqrt(2 * freedom) or before <= 0:
        return None
    plain = compare_models(first.data, model, catalogue, designs)
    smooth = plain.leader(smooth=True)
    if smooth is None or smooth.log_bf < ENOUGH_NEXT:
        return None
    return {
        "share": float(np.clip(after / before, 0.0, 1.0)),
        "over_floor": float(np.sqrt(1.0 + after / freedom)),
        "depends_on": list(channels_behind(plain)),
    }


def is_within_noise(first: Comparison) -> bool:
    """Return whether a model leaves clearly less than the noise that it is compared with: nothing can be missing.

    Only asked where the noise is not known from the readings: of readings, each kind of coordinate has a scale that is
    never below white noise, and so their chi2 is too small anyway.
    """
    if first.data.white_var is not None:
        return False
    chi2 = freedom = 0.0
    for axis, design in first.designs.items():
        excess, number = _excess(first, first, axis, replace(design, options=[]))
        chi2, freedom = chi2 + excess + number, freedom + number
    return bool(chdtrc(max(freedom, 1.0), chi2) > SURELY_NOISE)


def _excess(first: Comparison, final: Comparison, axis: str, design: Design) -> tuple[float, float]:
    """Return the chi2 beyond the degrees of freedom beside a base, at the noise of the final comparison, and these."""
    noise = final.axes[axis].best.noise
    y = first.data.error_dps(axis)
    (eliminated,) = eliminate_base(design, y, final.white_var[axis], final.scales[axis], [noise])
    freedom = float(design.present.sum() - (design.precision == 0).sum())
    return eliminated.chi2 - freedom, freedom


def is_better_than_smooth(
    first: Comparison,
    initial: Comparison,
    effect: Candidate,
    smooth: Candidate,
    discrepancy: Mapping[str, Discrepancy],
) -> bool:
    """Return whether an effect, its shape a few per cent wrong, has more evidence than a smooth function.

    All are compared at the scatter that remains beside the effect and its discrepancy.
    """
    if effect.term is None:
        return False
    model = first.model.with_added([effect.term])
    none, exact = (
        {axis: replace(design, options=[]) for axis, design in designs_beside(first, model, wrong).items()}
        for wrong in (discrepancy, {})
    )
    beside = compare_models(first.data, model, {}, none)
    lead = 0.0
    for axis in first.axes:
        y, design, wide, narrow = first.data.error_dps(axis), initial.designs[axis], none[axis], exact[axis]
        rivals = [design.options[c.option[axis]] for c in (effect, smooth) if axis in c.option]
        white, scale, noises = beside.white_var[axis], beside.scales[axis], beside.axes[axis].noises
        rival_evidence = evidence_of(replace(first.designs[axis], options=rivals), y, white, scale, noises)
        of = dict(zip([c.smooth for c in (effect, smooth) if axis in c.option], rival_evidence.log_bf, strict=True))
        shape = evidence_of(wide, y, white, scale, noises).log_p - evidence_of(narrow, y, white, scale, noises).log_p
        lead += max(of.get(False, 0.0), 0.0) + max(shape, 0.0) - max(of.get(True, 0.0), 0.0)
    return lead > LEAD
