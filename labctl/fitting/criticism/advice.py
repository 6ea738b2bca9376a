"""Advice: whether adding an effect that was named makes what is exported better where the fit has not seen the data.

A name is about the cause; advice is about the calibration. An effect that no calibration carries may be the cause, and
adding it still corrects nothing: what is exported is then the rest of the model, which the effect has moved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from labctl.answers.criticism import Advice
from labctl.errors import LabctlError
from labctl.fitting.criticism.held_out_recordings import PARTS, Mask, held_out_recordings
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.joined import recordings_in
from labctl.fitting.effects import Term, kind_of
from labctl.fitting.estimation.axis_solutions import residuals, solve_axes
from labctl.fitting.estimation.error_metrics import rms
from labctl.fitting.estimation.requirements import require_enough_data
from labctl.fitting.models.error_model import ErrorModel, is_exported
from labctl.fitting.models.fitted_model import FittedModel, without
from labctl.fitting.models.force_sensitivity import EFFECTS as OF_FORCE
from labctl.fitting.models.presets import Preset, changed
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Noise
from labctl.progress import report_stage
from labctl.texts import counted

#: A part is tested within the temperatures that the others were fitted at, and so far beyond, K.
BEYOND_K = 1.0
#: What is exported has to become better by this share: less is chance. A record at rest has few independent errors: a
#: drift that is correlated over half an hour has a dozen in three hours of three axes.
MIN_GAIN, MIN_GAIN_AT_REST = 0.01, 0.15
#: From so many parts on the gain also has to exceed what their scatter explains, at this probability (Student's t).
PARTS_THAT_SCATTER, CERTAIN = 3, 0.95


@dataclass(frozen=True)
class Exported:
    """Errors of what would be exported on parts of the data that the fit had not seen, deg/s."""

    before_dps: float | None
    after_dps: float | None
    least_gain: float = MIN_GAIN
    is_chance: bool = False  #: whether the gain differs so from part to part that it may be none
    needs: str = ""  #: where there is no error: what the data lack for one

    @property
    def is_known(self) -> bool:
        """Whether there is an error without the effect and one with it."""
        return self.before_dps is not None and self.after_dps is not None

    @property
    def is_better(self) -> bool:
        """Whether the export with the effect is better; not where one of the two cannot be had."""
        if self.before_dps is None or self.after_dps is None or self.is_chance:
            return False
        return self.after_dps < (1.0 - self.least_gain) * self.before_dps


def advice_for(
    data: FitData, model: ErrorModel, terms: Sequence[Term], beside: Sequence[Term] = ()
) -> tuple[Advice, ...]:
    """Return for each effect, in its shape, whether to add it to a model, and why; each beside those before it.

    The terms `beside` are in the model already.
    """
    advice: list[Advice] = []
    beside = list(beside)
    for term in terms:
        report_stage(f"checking what a calibration with {term.effect} would do")
        checked = exported_errors(data, model, tuple(beside), term)
        not_carried = _why_not_carried(term)
        reason = not_carried or _why_not_better(checked)
        advice.append(
            Advice(
                effect=term.effect,
                add=not reason,
                checked=bool(not_carried) or checked.is_known,
                why=reason,
                before_dps=checked.before_dps,
                after_dps=checked.after_dps,
            )
        )
        beside += [] if reason else [term]
    return tuple(advice)


def is_carried(term: Term) -> bool:
    """Return whether a calibration corrects an effect: in its model, or as the answer to specific force."""
    return is_exported(term) or term.effect in OF_FORCE


def _why_not_carried(term: Term) -> str:
    if is_carried(term):
        return ""
    kind = kind_of(term)
    if kind.origin in {"sensor", "package"}:
        return "a calibration cannot carry it: what it depends on is not known where the unit is used"
    return f"a calibration does not carry it: it belongs to the {kind.origin}, and not to the unit"


def _why_not_better(exported: Exported) -> str:
    if exported.is_better:
        return ""
    if exported.before_dps is None or exported.after_dps is None:
        return f"no part of these data can be left out to check it{exported.needs}"
    scatter = ", and from part to part the difference scatters by more" if exported.is_chance else ""
    return (
        f"what would be exported does not become clearly better on parts left out of the fit: {exported.after_dps:.3g} "
        f"deg/s in place of {exported.before_dps:.3g} deg/s{scatter}"
    )


def exported_errors(data: FitData, model: ErrorModel, beside: tuple[Term, ...], term: Term) -> Exported:
    """Return the errors of the exported part of a model, without and with a term, on parts left out in turn.

    The terms `beside` are in both.

    Left out are whole recordings of several (`held_out_recordings`), parts of the time of a record at rest, else
    temperatures.
    """
    presets = (changed(model, beside), changed(model, (*beside, term)))
    try:
        whole = [solve_axes(data, preset.build(data)[0]).noise for preset in presets]
    except LabctlError:
        return Exported(None, None)
    errors: tuple[list[dict[str, Array]], list[dict[str, Array]]] = ([], [])
    for data_used, left_out in parts_of(data, term, inner_only=presets[0].inner_only):
        try:
            axis_rms = [
                _left(data_used, left_out, p, axis_errors) for p, axis_errors in zip(presets, whole, strict=True)
            ]
        except LabctlError:  # a part that the others do not determine says nothing
            continue
        for parts, values in zip(errors, axis_rms, strict=True):
            parts.append(values)
    if not errors[0]:
        return Exported(None, None, needs=_needs(data, presets[1].build(data)[0]))
    before, after = (_pooled(parts) for parts in errors)
    least_gain = MIN_GAIN if np.any(data.channels.table_rate_dps()) else MIN_GAIN_AT_REST
    return Exported(before, after, least_gain, _is_chance(*errors))


def _needs(data: FitData, model: ErrorModel) -> str:
    """Return what a recording at several temperatures lacks for one to be left out, and what to do; "" for others."""
    at_rest = not np.any(data.channels.table_rate_dps())
    if len(recordings_in(data.channels.columns)) > 1 or at_rest or data.info.motion == "turns":
        return ""
    least = max((kind_of(term).least(term)[1] for term in model.terms), default=1)
    if isinstance(model.temperature, LagrangeTable):
        least = max(least, model.temperature.points)
    levels = data.distinct_temperatures()
    if levels > least:
        return ""
    others = counted(levels - 1, "temperature")
    return (
        f": beside one that is left out, {others} remain, and the model needs {least}; measure at "
        f"{counted(least + 1 - levels, 'more temperature')}, or add it and verify the version on another recording"
    )


def _is_chance(before: Sequence[dict[str, Array]], after: Sequence[dict[str, Array]]) -> bool:
    """Return whether the gain is within its scatter from part to part, as a difference and as a ratio of squares.

    A ratio is as clear in parts with small errors as in those with large ones; a difference is clear where one part has
    nearly all of the error.
    """
    squares = np.array([[_squares(part) for part in parts] for parts in (before, after)])
    squares = np.maximum(squares, np.finfo(np.float64).tiny)  # of data without noise
    n = squares.shape[1]
    if n < PARTS_THAT_SCATTER:
        return False
    factor = float(stdtrit(n - 1, CERTAIN)) / np.sqrt(n)
    gains = squares[0] - squares[1], np.log(squares[0] / squares[1])
    return all(bool(np.mean(gain) < factor * np.std(gain, ddof=1)) for gain in gains)


def _squares(errors: dict[str, Array]) -> float:
    return sum(float(values @ values) for values in errors.values())


def _pooled(parts: Sequence[dict[str, Array]]) -> float | None:
    return rms({axis: np.concatenate([part[axis] for part in parts]) for axis in parts[0]})


def _left(data_used: FitData, left_out: FitData, preset: Preset, noise: Mapping[str, Noise]) -> dict[str, Array]:
    """Return axis -> errors of data sets left out, corrected by what would be exported of a fit to the others."""
    model, rows = preset.build(data_used)
    training = data_used.take(rows)
    require_enough_data(training, model)
    solutions = solve_axes(training, model, noise)
    fitted = FittedModel(model, solutions.fits)
    for term in model.terms:
        fitted = fitted if is_carried(term) else without(fitted, term.effect)
    return dict(residuals(fitted, left_out, solutions.nuisance))


def parts_of(data: FitData, term: Term, *, inner_only: bool) -> Iterator[tuple[FitData, FitData]]:
    """Yield (the others, the part left out) of data sets; a part within the temperatures of the others."""
    masks: list[Mask]
    if len(recordings_in(data.channels.columns)) > 1:
        masks = held_out_recordings(data, term)
    elif "t_s" in data.channels and not np.any(data.channels.table_rate_dps()):
        order = np.argsort(np.asarray(data.channels["t_s"], dtype=np.float64), kind="stable")
        masks = [np.isin(np.arange(len(data)), part) for part in np.array_split(order, PARTS)]
    else:
        pairs = data.held_out_pairs
        yield from pairs[1:-1] if inner_only else pairs
        return
    for mask in masks:
        data_used = data.take(~mask)
        if len(data_used) == 0:
            continue
        low, high = float(data_used.temperature_c.min()) - BEYOND_K, float(data_used.temperature_c.max()) + BEYOND_K
        left_out = data.take(mask & (data.temperature_c >= low) & (data.temperature_c <= high))
        if len(left_out):
            yield data_used, left_out
