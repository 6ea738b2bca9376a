"""Suspects: the effects that may be missing, with probability, size and the error of a fit that includes each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtrc

from labctl.errors import LabctlError
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.verdict import (
    ENOUGH,
    Verdict,
    alias_group,
    coefficients_of,
    probabilities,
    share_removed,
)
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed

#: At most this many suspects are reported.
SHOWN = 6


@dataclass(frozen=True)
class Suspect:
    """An effect that may be missing."""

    candidate: Candidate
    probability: float
    p_value: float  #: of its gain in chi2, corrected for the number of options tried
    coefficients: Mapping[str, Any]  #: axis -> name -> value, u, unit
    share_removed: float  #: of the excess chi2, 0 to 1
    after: FitResult | None  #: fit with the effect added; None where it was not or cannot be fitted
    group: tuple[str, ...]  #: ids of the effects that cannot be distinguished from it, itself first


def suspects_of(
    comparison: Comparison, seen: Comparison, data: FitData, model: ErrorModel, verdict: Verdict
) -> list[Suspect]:
    """Return what may be missing, best first.

    The ranking is that of `comparison`; the sizes are those of `seen`, with the noise that remains beside a fuller
    model.
    """
    probability = probabilities(comparison.candidates)
    effects = [c for c in comparison.candidates if not c.smooth][:SHOWN]
    return [
        Suspect(
            candidate,
            probability[candidate.id],
            _p_value(comparison, seen, candidate),
            coefficients_of(seen, candidate),
            share_removed(seen, candidate),
            _fit_with(candidate, data, model, verdict),
            alias_group(comparison, candidate) if candidate.log_bf >= ENOUGH else (candidate.id,),
        )
        for candidate in effects
    ]


def _p_value(comparison: Comparison, seen: Comparison, candidate: Candidate) -> float:
    """Return the probability of such a gain in chi2 by chance, corrected for the mean number of options per axis."""
    dimensions = sum(int(seen.axes[a].dimensions[o]) for a, o in candidate.option.items())
    gain = sum(float(seen.axes[a].gain[o]) for a, o in candidate.option.items())
    tried = sum(len(d.options) for d in comparison.designs.values()) / max(len(comparison.designs), 1)
    single = float(chdtrc(max(dimensions, 1), gain))
    return float(-np.expm1(tried * np.log1p(-min(single, 1 - 1e-16))))


def _fit_with(candidate: Candidate, data: FitData, model: ErrorModel, verdict: Verdict) -> FitResult | None:
    """Return a fit of the model with the candidate added; None without evidence for it, or where it cannot be had."""
    if candidate.log_bf < 0 or candidate.term is None:
        return None
    term = verdict.terms.get(candidate.id, candidate.term)
    try:
        return fit_preset(data, changed(model, (term,)))
    except LabctlError:  # it cannot be fitted beside the base, or not be inverted: there is no figure
        return None
