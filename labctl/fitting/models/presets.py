"""The published models, and the plain ones that a person starts from, as sets of effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.temperature_levels import level_means
from labctl.fitting.effects import Reference, Term, parse_term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.temperature import LagrangeTable

Rows = NDArray[np.bool_]


@dataclass(frozen=True)
class Preset:
    """How to make a model for a recording: its effects, and which data sets it is fitted to."""

    name: str
    build: Callable[[FitData], tuple[ErrorModel, Rows]]
    inner_only: bool = False  #: held out: outer temperatures of a table cannot be interpolated


def _all(context: FitData) -> Rows:
    return np.ones(len(context), dtype=bool)


def _centre(context: FitData) -> Reference:
    """Centre on the middle of what was measured, to a whole degree."""
    return Reference(float(np.round((context.temperature_c.min() + context.temperature_c.max()) / 2)))


def _nodes(context: FitData, points: int, name: str) -> tuple[float, ...]:
    if context.levels is None:
        raise NotEnoughData(
            f"{context.info.serial}: model {name} needs discrete temperature levels; these temperatures run on from "
            f"{context.temperature_c.min():.1f} to {context.temperature_c.max():.1f} deg C without gaps"
        )
    means = level_means(context.temperature_c, context.levels)
    if len(means) < points:
        raise NotEnoughData(
            f"{context.info.serial}: model {name} interpolates between {points} temperatures; the recording has "
            f"{len(means)}, measure at {points - len(means)} more; a recording at fewer is fitted by "
            "`--effects bias,scale_factor,misalignment`"
        )
    return tuple(float(t) for t in means)


ALIGNED = (Term("bias"), Term("scale_factor"), Term("misalignment"))


def _ojeda2000(context: FitData) -> tuple[ErrorModel, Rows]:
    terms = (Term("rate_temperature_surface", 3), *((Term("misalignment"),) if len(context.info.axes) > 1 else ()))
    return ErrorModel("ojeda2000", terms, "output", reference=_centre(context)), _all(context)


def _yang2018(context: FitData) -> tuple[ErrorModel, Rows]:
    table = LagrangeTable(_nodes(context, 3, "yang2018"), 3)
    return ErrorModel("yang2018", ALIGNED, "rate", table, _centre(context)), _all(context)


def _single_temperature(context: FitData) -> tuple[ErrorModel, Rows]:
    levels = context.levels
    if levels is None:
        raise NotEnoughData(f"{context.info.serial}: model single_temperature needs discrete temperature levels")
    nearest = int(np.argmin(np.abs(level_means(context.temperature_c, levels) - 25.0)))
    return ErrorModel("single_temperature", ALIGNED, "rate", reference=Reference(25.0)), levels == nearest


def _weiss1995(context: FitData) -> tuple[ErrorModel, Rows]:
    table = LagrangeTable(_nodes(context, 2, "weiss1995"), 2)
    terms = (Term("bias"), Term("scale_factor"))
    return ErrorModel("weiss1995", terms, "rate", table, _centre(context)), _all(context)


def _bias_scale(context: FitData) -> tuple[ErrorModel, Rows]:
    aligned = (Term("misalignment"),) if len(context.info.axes) > 1 else ()
    terms = (Term("bias"), Term("bias_temperature"), Term("scale_factor"), Term("scale_factor_temperature"), *aligned)
    return ErrorModel("bias_scale", terms, "rate", reference=_centre(context)), _all(context)


#: name -> (preset, one sentence for a person)
PRESETS: dict[str, tuple[Preset, str]] = {
    "ojeda2000": (
        Preset("ojeda2000", _ojeda2000),
        "Ojeda, Chung, Borenstein 2000: the error as a cubic in the output and a parabola in temperature, 12 numbers.",
    ),
    "yang2018": (
        Preset("yang2018", _yang2018, inner_only=True),
        "Yang et al. 2018: bias, scale factor and misalignment at each temperature, three-point Lagrange between them.",
    ),
    "single_temperature": (
        Preset("single_temperature", _single_temperature),
        "The traditional method: bias, scale factor and misalignment from the temperature nearest 25 deg C alone.",
    ),
    "weiss1995": (
        Preset("weiss1995", _weiss1995, inner_only=True),
        "Weiss 1995: scale factor and offset against temperature, straight lines between them.",
    ),
    "bias_scale": (
        Preset("bias_scale", _bias_scale),
        "A plain start: bias and scale factor, each a parabola in temperature.",
    ),
}


def preset_for(model: str | None, effects: list[str]) -> Preset:
    """Return how to make the model that a person asks for.

    Effects alone are a complete model; with a model they are added to it. Raises BadInput for an unknown name.
    """
    terms = tuple(parse_term(text) for text in effects)
    if model is None and not terms:
        raise BadInput(f"say which model to fit: --model {'|'.join(PRESETS)} or --effects A,B,C")
    if model is None:
        return Preset("custom", lambda context: (_custom(terms, context), _all(context)))
    if model not in PRESETS:
        raise BadInput(f"error model {model!r} is not known; there are {', '.join(PRESETS)}")
    preset, _ = PRESETS[model]
    if not terms:
        return preset

    def extended(context: FitData) -> tuple[ErrorModel, Rows]:
        base, rows = preset.build(context)
        added = tuple(replace(term, steady=True) for term in terms if term.effect not in base.effect_ids)
        return base.with_terms((*base.terms, *added), f"{model}+{'+'.join(t.effect for t in added)}"), rows

    return Preset(model, extended, preset.inner_only)


def changed(model: ErrorModel, add: tuple[Term, ...] = (), remove: tuple[str, ...] = ()) -> Preset:
    """Return how to fit a model again in its forward form, with effects added and others left out."""
    kept = tuple(t for t in model.terms if t.effect not in {*remove, *(term.effect for term in add)})
    name = model.name + "".join(f"+{t.effect}" for t in add) + "".join(f"-{effect_id}" for effect_id in remove)

    def build(context: FitData) -> tuple[ErrorModel, Rows]:
        table = model.temperature
        if isinstance(table, LagrangeTable):
            table = LagrangeTable(_nodes(context, table.points, model.name), table.points)
        terms = (*kept, *(replace(term, steady=True) for term in add))
        return replace(model.forward(), name=name, terms=terms, temperature=table), _all(context)

    return Preset(name, build, isinstance(model.temperature, LagrangeTable))


def _custom(terms: tuple[Term, ...], context: FitData) -> ErrorModel:
    return ErrorModel("custom", terms, "rate", reference=_centre(context))


def describe_presets() -> list[dict[str, Any]]:
    """Return every preset as JSON."""
    return [{"name": name, "sentence": sentence} for name, (_, sentence) in PRESETS.items()]
