"""Visibility: which effects a schedule can show beside a model, and from which size on."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labctl.answers.criticism import NotTestable
from labctl.errors import NotEnoughData
from labctl.fitting.criticism.candidate_shape import CandidateShape, slices_of
from labctl.fitting.criticism.candidates import untestable_channels
from labctl.fitting.criticism.evidence.design import Design, EliminatedBase
from labctl.fitting.criticism.evidence.elimination import eliminate_base
from labctl.fitting.criticism.evidence.gains import visible_share
from labctl.fitting.criticism.evidence.noise_grid import Noise, expected_drift_dps
from labctl.fitting.criticism.model_comparison import Comparison, design_of
from labctl.fitting.criticism.ranking import largest_physical
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Effect
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import usual_model
from labctl.fitting.models.temperature import Constant
from labctl.recording import Recording

#: An effect of which less than this share is visible beside the model cannot be shown by the schedule.
MIN_VISIBLE = 0.15
#: Size of a just detectable effect, in noise units.
DETECTABLE_Z = 5.0
#: Contains several other effects, and so is never what is missing.
NEVER_MISSING = "rate_temperature_surface"
#: What it contains: powers of rate and temperature.
IN_SURFACE = frozenset(
    {"bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "scale_factor_even", "scale_factor_odd"}
)


@dataclass(frozen=True)
class Schedule:
    """A schedule beside a model: everything but the output, with the base eliminated."""

    data: ReducedRecording
    designs: Mapping[str, Design]  #: by axis
    left: Mapping[str, EliminatedBase]  #: by axis
    slices: Mapping[str, list[slice]]  #: by axis
    in_model: frozenset[str]  #: effects that are part of the model

    def options(self, axis: str) -> list[tuple[CandidateShape, slice]]:
        """Return every shape of every effect on one axis, with its place in the Gram matrix."""
        return list(zip(self.designs[axis].options, self.slices[axis], strict=True))


@dataclass(frozen=True)
class EffectVisibility:
    """Whether a schedule can show an effect, and from which size on."""

    effect: str
    visible: bool
    share: float  #: of the effect, that the model beside it does not absorb, 0 to 1
    smallest_size: float | None = None  #: just detectable, in `unit`; where `why` is "size": more than it can be
    unit: str = ""
    why: Literal["channel", "schedule", "size", "technology"] | None = None  #: what hides it, or why there is none
    needs: tuple[str, ...] = ()  #: channels that are not logged
    experiment: str = ""  #: what would show it
    in_model: bool = False  #: the effect is part of the model beside it, which estimates it
    order: int | None = None  #: of the term that `smallest_size` is of, where the model absorbs the lower ones


def schedule_of(recording: Recording, model: ErrorModel | None = None) -> Schedule:
    """Return the schedule of a recording, whose output is not used.

    `model` (default: the published one for such a recording) is the base beside which effects stand. Raises
    NotEnoughData where the recording cannot determine it.
    """
    return schedule_beside(reduce_recording(recording, outliers=False), model or usual_model(fit_data_of(recording)))


def schedule_beside(data: ReducedRecording, model: ErrorModel) -> Schedule:
    """Return the schedule of a reduced recording beside a model. Raises NotEnoughData."""
    info = data.info
    if data.white_var is None:
        raise NotEnoughData(
            f"{info.serial}: the noise of a data set's mean is not known: each data set has fewer than 6 readings, or "
            "readings that are all equal; measure longer, or at more readings per second"
        )
    drift = Noise(expected_drift_dps(info.technology or "", info.stability_dps), 0.0, 0.0)
    designs, eliminated_by_axis, slices = {}, {}, {}
    for axis in map(str, info.axes):
        design = design_of(data, model, axis)
        white = data.white_var[axis]
        scale = np.repeat(np.sqrt(white)[None, :], len(data.present), axis=0)
        no_output: NDArray[np.float64] = np.zeros(data.present.shape)
        designs[axis] = design
        eliminated_by_axis[axis] = eliminate_base(design, no_output, white, scale, [drift])[0]
        slices[axis] = slices_of(design.options)
    return Schedule(data, designs, eliminated_by_axis, slices, _parts_of(model))


def _parts_of(model: ErrorModel) -> frozenset[str]:
    """Return the effects that a model estimates: its terms, and what a surface or a table over temperature contains."""
    terms = frozenset(model.effect_ids)
    over_temperature = () if isinstance(model.temperature, Constant) else (f"{each}_temperature" for each in terms)
    return terms.union(over_temperature, IN_SURFACE if NEVER_MISSING in terms else ()) & frozenset(CATALOGUE)


def effect_visibilities(schedule: Schedule) -> list[EffectVisibility]:
    """Return every effect of the catalogue with its visible share and smallest detectable size, most visible first."""
    absent = untestable_channels(schedule.data)
    visibilities = [
        replace(_of_effect(schedule, effect_id, absent.get(effect_id)), in_model=effect_id in schedule.in_model)
        for effect_id in CATALOGUE
        if effect_id != NEVER_MISSING
    ]
    return sorted(visibilities, key=lambda v: -v.share)


def _of_effect(schedule: Schedule, effect_id: str, absent: list[str] | None) -> EffectVisibility:
    if absent:
        return EffectVisibility(effect_id, False, 0.0, why="channel", needs=tuple(absent))
    share = 0.0
    sizes: dict[str, float] = {}
    orders: dict[str, int | None] = {}
    for axis in schedule.designs:
        for option, option_rows in schedule.options(axis):
            if option.candidate != effect_id:
                continue
            axis_share = visible_share(schedule.left[axis], option_rows)
            share = max(share, axis_share)
            if axis_share < MIN_VISIBLE:
                continue
            norms = np.sqrt(np.maximum(np.diag(schedule.left[axis].gram)[option_rows], 0.0))
            best = int(np.argmax(norms))
            size = DETECTABLE_Z / max(float(norms[best]), 1e-300)
            sizes[option.units[best]] = min(size, sizes.get(option.units[best], np.inf))
            orders[option.units[best]] = _further_order(option, best)
    if share < MIN_VISIBLE:
        return EffectVisibility(effect_id, False, share, why="schedule", experiment=CATALOGUE[effect_id].experiment)
    unit_symbol = next(iter(sizes), "")  # of the lowest order that is visible
    smallest = sizes.get(unit_symbol)
    largest = largest_physical(effect_id, unit_symbol, schedule.data.info.technology or "")
    if largest == 0:
        return EffectVisibility(effect_id, False, share, why="technology")
    if smallest is not None and smallest > largest:
        experiment, order = CATALOGUE[effect_id].experiment, orders.get(unit_symbol)
        return EffectVisibility(
            effect_id, False, share, smallest, unit_symbol, "size", experiment=experiment, order=order
        )
    return EffectVisibility(effect_id, True, share, smallest, unit_symbol, order=orders.get(unit_symbol))


def _further_order(option: CandidateShape, column: int) -> int | None:
    """Return the order of a column of a polynomial; None for the first, whose unit is that of the effect."""
    of_order = re.search(r"_[rt](\d+)$", option.names[column])
    if column == 0 or of_order is None or option.units[column] == option.units[0]:
        return None
    return int(of_order[1])


def not_testable(comparison: Comparison, catalogue: Mapping[str, Effect]) -> list[NotTestable]:
    """Return the effects that a recording cannot show, as JSON: a channel is missing, or the schedule hides them."""
    absent = untestable_channels(comparison.data, catalogue)
    untestable: list[NotTestable] = [
        {"effect": effect_id, "why": "channel", "needs": needs} for effect_id, needs in absent.items()
    ]
    shares = visible_shares(comparison)
    for kind in catalogue.values():
        if kind.id in absent or kind.id in comparison.model.effect_ids or kind.id == NEVER_MISSING:
            continue
        if shares.get(kind.id, 0.0) < MIN_VISIBLE:
            untestable.append({"effect": kind.id, "why": "schedule", "needs": [], "visible": shares.get(kind.id, 0.0)})
    return untestable


def visible_shares(comparison: Comparison) -> dict[str, float]:
    """Return effect id -> the share that is visible beside the base, 0 to 1, in its most visible shape."""
    shares: dict[str, float] = {}
    for axis, design in comparison.designs.items():
        axis_comparison = comparison.axes[axis]
        for option, option_rows in zip(design.options, axis_comparison.slices, strict=True):
            if not option.smooth:
                share = visible_share(axis_comparison.best, option_rows)
                shares[option.candidate] = max(shares.get(option.candidate, 0.0), share)
    return shares
