"""The published models, and the plain ones that a person starts from, as sets of effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.effects import PresetJson
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.temperature.levels import level_means
from labctl.fitting.effects import Reference, Term, parse_term
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.held import Held
from labctl.fitting.models.temperature import LagrangeTable

Rows = NDArray[np.bool_]


@dataclass(frozen=True)
class Preset:
    """How to make a model for a recording: its effects, and which data sets it is fitted to."""

    name: str
    build: Callable[[FitData], tuple[ErrorModel, Rows]]
    inner_only: bool = False  #: held out: outer temperatures of a table cannot be interpolated


def _all(data: FitData) -> Rows:
    return np.ones(len(data), dtype=bool)


def _centre(data: FitData) -> Reference:
    """Centre on the middle of what was measured, to a whole degree."""
    return Reference(float(np.round((data.temperature_c.min() + data.temperature_c.max()) / 2)))


def _nodes(data: FitData, points: int, name: str) -> tuple[float, ...]:
    if data.levels is None:
        raise NotEnoughData(
            f"{data.info.serial}: model {name} needs discrete temperature levels; the temperatures of this "
            f"recording vary continuously from {data.temperature_c.min():.1f} to {data.temperature_c.max():.1f} "
            "deg C; fit `--effects` instead, or measure at fixed temperatures"
        )
    means = level_means(data.temperature_c, data.levels)
    if len(means) < points:
        raise NotEnoughData(
            f"{data.info.serial}: model {name} interpolates between {points} temperatures; the recording has "
            f"{len(means)}; measure at {points - len(means)} more, or fit `--effects bias,scale_factor,misalignment`"
        )
    return tuple(float(t) for t in means)


#: Temperatures that a parabola in temperature needs, and their span, deg C.
PARABOLA_TEMPERATURES, PARABOLA_SPAN_C = 3, 2.0
ALIGNED = (Term("bias"), Term("scale_factor"), Term("misalignment"))


def _ojeda2000(data: FitData) -> tuple[ErrorModel, Rows]:
    terms = (Term("rate_temperature_surface", 3), *((Term("misalignment"),) if len(data.info.axes) > 1 else ()))
    return ErrorModel("ojeda2000", terms, "output", reference=_centre(data)), _all(data)


def _yang2018(data: FitData) -> tuple[ErrorModel, Rows]:
    table = LagrangeTable(_nodes(data, YANG_LEVELS, "yang2018"), YANG_LEVELS)
    return ErrorModel("yang2018", ALIGNED, "rate", table, _centre(data)), _all(data)


def _single_temperature(data: FitData) -> tuple[ErrorModel, Rows]:
    levels, terms = data.levels, ALIGNED if len(data.info.axes) > 1 else ALIGNED[:2]
    if levels is None and _is_one_temperature(data):
        levels = np.zeros(len(data), dtype=np.int64)
    if levels is None:
        raise NotEnoughData(
            f"{data.info.serial}: model single_temperature needs discrete temperature levels; fit `--effects "
            f"{','.join(term.effect for term in terms)}` instead"
        )
    nearest = int(np.argmin(np.abs(level_means(data.temperature_c, levels) - 25.0)))
    return ErrorModel("single_temperature", terms, "rate", reference=Reference(25.0)), levels == nearest


def _is_one_temperature(data: FitData) -> bool:
    """Return whether temperatures without discrete levels are too near each other for a parabola in temperature."""
    span_c = float(np.ptp(data.temperature_c))
    return data.distinct_temperatures() < PARABOLA_TEMPERATURES or span_c < PARABOLA_SPAN_C


def _weiss1995(data: FitData) -> tuple[ErrorModel, Rows]:
    table = LagrangeTable(_nodes(data, 2, "weiss1995"), 2)
    terms = (Term("bias"), Term("scale_factor"))
    return ErrorModel("weiss1995", terms, "rate", table, _centre(data)), _all(data)


def _bias_scale(data: FitData) -> tuple[ErrorModel, Rows]:
    aligned = (Term("misalignment"),) if len(data.info.axes) > 1 else ()
    terms = (Term("bias"), Term("bias_temperature"), Term("scale_factor"), Term("scale_factor_temperature"), *aligned)
    return ErrorModel("bias_scale", terms, "rate", reference=_centre(data)), _all(data)


def _bias(data: FitData) -> tuple[ErrorModel, Rows]:
    return ErrorModel("bias", (Term("bias"),), "rate", reference=_centre(data)), _all(data)


def _bias_temperature(data: FitData) -> tuple[ErrorModel, Rows]:
    terms = (Term("bias"), Term("bias_temperature"))
    return ErrorModel("bias_temperature", terms, "rate", reference=_centre(data)), _all(data)


def _turns(data: FitData) -> tuple[ErrorModel, Rows]:
    several = len(data.info.axes) > 1
    aligned = ALIGNED if several else ALIGNED[:2]
    gravity = (Term("g_sensitivity"), *((Term("cross_g_sensitivity"),) if several else ()))
    terms = aligned + (gravity if _rests_both_ways(data) else ())
    return ErrorModel("turns", terms, "rate", reference=_centre(data)), _all(data)


def _rests_both_ways(data: FitData) -> bool:
    """Whether every body axis that is used rested pointing up, and pointing down: gravity then differs from bias."""
    still = data.channels.table_rate_dps() == 0
    position = np.asarray(data.channels["position"]).astype(np.str_)
    used_axes = {*data.info.axes, *np.char.lstrip(position, "-").tolist()}
    return {sign + axis for axis in used_axes for sign in ("", "-")} <= set(position[still].tolist())


#: The model of a recording in poses; `labctl.fitting.poses` fits it, since no data set of it has a known rate.
POSES = "poses"


def _poses(data: FitData) -> tuple[ErrorModel, Rows]:
    raise BadInput(
        f"{data.info.serial}: model {POSES} needs a recording with motion = 'poses', but this recording has motion = "
        f"{data.info.motion!r}; choose another model"
    )


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
        "The traditional method at the temperature nearest 25 deg C: bias, scale factor, of several axes misalignment.",
    ),
    "weiss1995": (
        Preset("weiss1995", _weiss1995, inner_only=True),
        "Weiss 1995: scale factor and offset against temperature, straight lines between them.",
    ),
    "bias_scale": (
        Preset("bias_scale", _bias_scale),
        "A simple model to start with: bias and scale factor, each a parabola in temperature.",
    ),
    "bias_temperature": (
        Preset("bias_temperature", _bias_temperature),
        "For a recording at rest: the bias as a parabola in temperature; lag, hysteresis and warm-up can be added.",
    ),
    "bias": (
        Preset("bias", _bias),
        "For a recording at rest: one bias for each axis; no table and no thermometer needed.",
    ),
    "turns": (
        Preset("turns", _turns),
        "For turns by a known angle: bias, scale factor, misalignment; g-sensitivity if the unit rested both ways up.",
    ),
    POSES: (
        Preset(POSES, _poses),
        "By hand, without a table (Tedaldi et al. 2014): rests in many poses; gravity shows where each turn ended.",
    ),
}


def preset_for(model: str | None, effects: list[str]) -> Preset:
    """Return how to make the model that a person asks for.

    Effects alone are a complete model; with a model they are added to it. Raises BadInput for an unknown name.
    """
    terms = tuple(parse_term(text) for text in effects)
    if model is None and not terms:
        raise BadInput(f"give the model to fit: --model {'|'.join(PRESETS)} or --effects A,B,C")
    if model is None:
        return Preset("custom", lambda data: (_custom(terms, data), _all(data)))
    if model not in PRESETS:
        raise BadInput(f"error model {model!r} is not known; choose one of {', '.join(PRESETS)}")
    preset, _ = PRESETS[model]
    if not terms:
        return preset

    def extended(data: FitData) -> tuple[ErrorModel, Rows]:
        base, rows = preset.build(data)
        added = tuple(replace(term, steady=True) for term in terms if term.effect not in base.effect_ids)
        return base.with_terms((*base.terms, *added), f"{model}+{'+'.join(t.effect for t in added)}"), rows

    return Preset(model, extended, preset.inner_only)


def changed(model: ErrorModel, add: tuple[Term, ...] = (), remove: tuple[str, ...] = ()) -> Preset:
    """Return how to fit a model again in its forward form, with effects added and others left out.

    What the model holds stays held, but for the effects that are added: their coefficients are estimated.
    """
    held = model.forward().held.beside((*remove, *(term.effect for term in add)))
    kept_terms = tuple(t for t in model.terms if t.effect not in {*remove, *(term.effect for term in add)})
    name = model.name + "".join(f"+{t.effect}" for t in add) + "".join(f"-{effect_id}" for effect_id in remove)

    def build(data: FitData) -> tuple[ErrorModel, Rows]:
        table = model.temperature
        if isinstance(table, LagrangeTable):
            table = LagrangeTable(_nodes(data, table.points, model.name), table.points)
        terms = (*kept_terms, *(replace(term, steady=True) for term in add))
        return replace(model.forward(), name=name, terms=terms, temperature=table, held=held), _all(data)

    return Preset(name, build, isinstance(model.temperature, LagrangeTable))


def holding(preset: Preset, held: Held, reference: Reference | None = None) -> Preset:
    """Return a preset whose model holds coefficients, and is centred on the reference that they are given for."""

    def build(data: FitData) -> tuple[ErrorModel, Rows]:
        model, rows = preset.build(data)
        return replace(model, held=held, reference=reference or model.reference), rows

    return Preset(preset.name, build, preset.inner_only)


def unchanged(model: ErrorModel) -> Preset:
    """Return how to fit a model again exactly as it is, to all data sets."""
    return Preset(model.name, lambda data: (model, _all(data)))


#: Temperatures that yang2018 interpolates between.
YANG_LEVELS = 3
#: A parabola of the bias takes more different temperatures than it has coefficients beside the constant.
BIAS_LEVELS = 2


def usual_model(data: FitData) -> ErrorModel:
    """Return the published model that fits a recording's axes, in its forward form.

    Raises NotEnoughData where the data sets cannot determine it.
    """
    if data.info.motion == "turns":
        name = "turns"
    elif not np.any(data.channels.table_rate_dps()):
        name = "bias_temperature" if data.distinct_temperatures() > BIAS_LEVELS else "bias"
    else:
        name = _usual_on_a_table(data)
    model, _ = preset_for(name, []).build(data)
    return changed(model).build(data)[0]


def _usual_on_a_table(data: FitData) -> str:
    """Return the model of a first fit to rates of a table; a table over the temperature needs its levels."""
    if len(data.info.axes) == 1 or data.levels is None:
        return "ojeda2000"
    return "yang2018" if len(level_means(data.temperature_c, data.levels)) >= YANG_LEVELS else "bias_scale"


def _custom(terms: tuple[Term, ...], data: FitData) -> ErrorModel:
    return ErrorModel("custom", terms, "rate", reference=_centre(data))


def describe_presets() -> list[PresetJson]:
    """Return every preset as JSON."""
    return [{"name": name, "sentence": sentence} for name, (_, sentence) in PRESETS.items()]
