"""Suspects: the effects that may be missing, with probability, size and the error of a fit that includes each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from labctl.answers.fitted_model import Coefficient
from labctl.errors import LabctlError
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.ranking import Candidate
from labctl.fitting.criticism.search.refinement import refined_term
from labctl.fitting.criticism.verdict import (
    ENOUGH,
    alias_group,
    coefficients_of,
    probabilities,
    share_removed,
)
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.effects import CATALOGUE, Effect, kind_of
from labctl.fitting.effects.derived import with_derived
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed
from labctl.fitting.numeric.json_numbers import none_for_nan
from labctl.progress import report_stage

#: At most this many suspects are reported.
SHOWN = 6
#: At most this many more suspects have the evidence, but a size that the unit's technology cannot have.
UNPHYSICAL_SHOWN = 2

#: What takes off less than this share of the error above the noise floor is no cause of it.
MIN_CAUSE = 0.1
#: A fit with another effect that leaves this share more is worse, and not only weighed otherwise.
WORSE_BY = 0.01


@dataclass(frozen=True)
class Suspect:
    """An effect that may be missing."""

    candidate: Candidate
    probability: float
    p_value: float  #: of its gain in chi2, corrected for the number of options tried
    coefficients: Mapping[str, Mapping[str, Coefficient]]  #: axis -> name -> value, u (None: unknown), unit
    is_fitted: bool  #: whether these are those of `after`, which a version with the effect has; else of the comparison
    share_removed: float  #: of the excess chi2, 0 to 1
    after: FitResult | None  #: fit with the effect added; None where it was not or cannot be fitted
    group: tuple[str, ...]  #: ids of the effects that cannot be distinguished from it, itself first
    refused: str = ""  #: why the model with the effect cannot be fitted; empty where it is fitted, or was not tried

    @property
    def kind(self) -> Effect:
        """The effect in its shape."""
        return kind_of(self.candidate.term) if self.candidate.term is not None else CATALOGUE[self.candidate.id]

    def is_usual(self, technology: str) -> bool | None:
        """Return whether a technology usually has its first coefficient on every axis; None where no range is known."""
        firsts = [next(iter(by_name.values())) for by_name in self.coefficients.values() if by_name]
        outside = [
            self.kind.outside(technology, float(first["value"]), np.nan if first["u"] is None else float(first["u"]))
            for first in firsts
        ]
        return None if not outside or None in outside else not any(outside)


def suspects_of(
    comparison: Comparison,
    fuller: Comparison,
    data: FitData,
    model: ErrorModel,
    before: FitResult | None,
    named: Collection[str],
) -> tuple[Suspect, ...]:
    """Return what may be missing, best first; last what is of a size that the unit's technology cannot have.

    The ranking is that of `comparison`. Coefficients are those of a fit with the effect in its best shape, the one that
    adding the effect makes; without that fit they are those of `fuller`, with the noise that remains beside a fuller
    model. What the verdict has `named` is listed; another effect only where its fit leaves no more than `before`, the
    fit of the model.
    """
    probability = probabilities(comparison.candidates)
    effects = [c for c in comparison.candidates if not c.smooth]
    physical = [c for c in effects if c.physical]
    shown_candidates = [c for k, c in enumerate(physical) if k < SHOWN or c.id in named]
    shown_candidates += [c for c in effects if not c.physical and c.log_bf >= ENOUGH][:UNPHYSICAL_SHOWN]
    suspects = []
    for candidate in shown_candidates:
        after, refused = _fit_with(comparison, candidate, data, model)
        if after is not None and candidate.id not in named and _is_worse(before, after):
            continue  # another shape of an effect that the model has: what it would replace fits better
        share = _share(before, after, share_removed(fuller, candidate))
        fitted = _fitted_coefficients(after, candidate) if after and candidate.id not in model.effect_ids else {}
        suspect = Suspect(
            candidate, probability[candidate.id], _p_value(comparison, fuller, candidate),
            fitted or coefficients_of(fuller, candidate), bool(fitted), share, after,
            alias_group(comparison, candidate) if candidate.log_bf >= ENOUGH else (candidate.id,), refused,
        )  # fmt: skip
        suspects.append(suspect)
    return tuple(suspects)


def is_only_shape(suspect: Suspect, model: ErrorModel) -> bool:
    """Return whether a suspect is another shape of an effect that the model has, and lowers the error hardly at all."""
    return suspect.candidate.id in model.effect_ids and suspect.share_removed < MIN_CAUSE


def without_shapes(suspects: Sequence[Suspect], model: ErrorModel) -> tuple[Suspect, ...]:
    """Return the suspects without those that are only other shapes of what the model has, also in their groups."""
    shapes = {suspect.candidate.id for suspect in suspects if is_only_shape(suspect, model)}
    return tuple(
        replace(suspect, group=tuple(name for name in suspect.group if name not in shapes))
        for suspect in suspects
        if suspect.candidate.id not in shapes
    )


def with_groups(suspects: Sequence[Suspect], groups: Sequence[Sequence[str]]) -> tuple[Suspect, ...]:
    """Return the suspects, each that a verdict names in the group of the verdict, itself first.

    What cannot be distinguished from a suspect is judged from that suspect; the verdict judges from its leader, with
    the noise that remains beside all that is missing. One recording has one list.
    """
    of_verdict = {name: group for group in groups for name in group}
    return tuple(
        replace(each, group=tuple(sorted(of_verdict[each.candidate.id], key=each.candidate.id.__ne__)))
        if each.candidate.id in of_verdict
        else each
        for each in suspects
    )


def _is_worse(before: FitResult | None, after: FitResult) -> bool:
    """Return whether a fit leaves more of the data sets than the one before it."""
    if before is None or before.error.rms_dps is None or after.error.rms_dps is None:
        return False
    return after.error.rms_dps > (1.0 + WORSE_BY) * before.error.rms_dps


def _share(before: FitResult | None, after: FitResult | None, compared: float) -> float:
    """Return the share of the excess that a suspect removes: no more than what the fit with it leaves allows.

    `compared` is that of the comparison, which alone sees what goes on within data sets; the noise of the recording is
    no excess. 0 to 1.
    """
    if before is None or after is None or before.error.rms_dps is None or after.error.rms_dps is None:
        return compared
    floor = before.error.noise_floor_dps or 0.0
    excess, after_squared = (max(fit.error.rms_dps or 0.0, floor) ** 2 - floor**2 for fit in (before, after))
    if excess <= 0.0:  # nothing between data sets
        return compared
    return float(np.clip(1.0 - after_squared / excess, 0.0, 1.0))


def _p_value(comparison: Comparison, fuller: Comparison, candidate: Candidate) -> float:
    """Return the probability of such a gain in chi2 by chance, corrected for the mean number of options per axis."""
    dimensions = sum(int(fuller.axes[a].dimensions[o]) for a, o in candidate.option.items())
    gain = sum(float(fuller.axes[a].gain[o]) for a, o in candidate.option.items())
    tried = sum(len(d.options) for d in comparison.designs.values()) / max(len(comparison.designs), 1)
    single = float(chdtrc(max(dimensions, 1), gain))
    return float(-np.expm1(tried * np.log1p(-min(single, 1 - 1e-16))))


def _fit_with(
    comparison: Comparison, candidate: Candidate, data: FitData, model: ErrorModel
) -> tuple[FitResult | None, str]:
    """Return a fit of the model with the candidate added, and why there is none: it is refused, or has no evidence."""
    if candidate.log_bf < 0 or candidate.term is None:
        return None, ""
    report_stage(f"fitting the model with {candidate.id}")
    try:
        return fit_preset(data, changed(model, (refined_term(comparison, candidate),))), ""
    except LabctlError as error:  # it cannot be determined beside the base, or not be inverted
        return None, str(error)


def _fitted_coefficients(after: FitResult, candidate: Candidate) -> dict[str, dict[str, Coefficient]]:
    """Return axis -> name -> value, u and unit of the candidate in a fit, on the axes on which it competed."""
    by_axis: dict[str, dict[str, Coefficient]] = {}
    for axis in (axis for axis in candidate.option if axis in after.fitted.axes):
        fit = after.fitted.axes[axis]
        rows = [k for k, owner in enumerate(fit.effects) if owner == candidate.id]
        # one coefficient for all temperatures: the columns of a table are alike
        by_axis[axis] = with_derived({
            fit.names[k]: {"value": float(fit.values[k, 0]), "u": none_for_nan(fit.u)[k][0], "unit": fit.units[k]}
            for k in rows
        })  # fmt: skip
    return {axis: values for axis, values in by_axis.items() if values}
