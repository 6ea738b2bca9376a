"""Which pictures there are, in which order, and how to read each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import plotly.graph_objects as go

from labctl.answers.comparison import ComparisonResponse
from labctl.answers.criticism import CriticismResponse
from labctl.answers.ladder import LadderResponse
from labctl.plots import model_lines, noise, residual_lines, residual_maps, spectra

AnswerT = TypeVar("AnswerT")


@dataclass(frozen=True)
class Picture:
    """One figure, with what it is called, how to read it, and which effects would draw something there."""

    id: str
    title: str
    caption: str
    figure: go.Figure
    effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Kind(Generic[AnswerT]):
    id: str
    title: str
    caption: str
    draw: Callable[[AnswerT], go.Figure | None]


KINDS = (
    _Kind(
        "map", "Where the model fails, in rate and temperature",
        "Each cell shows the mean residual of its data sets divided by the noise floor; all measured cells are "
        "drawn. Red: the measured error is above the model; blue: below it. All maps have the same colour "
        "scale. Data sets share a cell if their rates agree within 0.1 % and their temperatures within 0.25 K. "
        "Dimmed cells are less than two noise floors from zero; a single dimmed cell is not significant. If a "
        "column is coloured from top to bottom, the residual depends on the rate; if a row is, on the "
        "temperature; if one corner is, on both.",
        residual_maps.maps,
    ),
    _Kind(
        "channels", "Residual against every logged channel",
        "Dots: data sets. Line: their running mean, or the mean at each level. Band: the 95 % interval of that "
        "mean, including the drift between data sets. If the band excludes zero, the error depends on this "
        "channel or on another channel that changes together with it. Time and temperature change together if "
        "the temperature only rises."
        "",
        residual_lines.channels,
    ),
    _Kind(
        "time", "Residual against time",
        "Upper plot: residual; lower plot: temperature; dotted lines: power-ons. If the times are not known, "
        "the data sets are drawn in order. A slope is drift, a step at a power-on or a re-mounting is a shift, "
        "a decay after a power-on is warm-up. The lag-1 correlation and the runs test use the residuals after "
        "subtraction of the drift in the noise model: a small p means that successive residuals are still correlated."
        "",
        residual_lines.time,
    ),
    _Kind(
        "angle", "Periodic errors over the table angle, within data sets",
        "Mean power divided by that of white noise, for each number of cycles per turn. A bar above the dashed "
        "limit is a spectral line; noise alone puts one bar of a panel above it with a probability of about 5 "
        "%. Once per turn: the Earth's rate, a magnetic field or a tilt. Four times per turn: the gear. The "
        "lines of the stepper motor (50 and 200 per turn) and, if the latitude is known, that of the Earth are "
        "removed: bars well below 1 are the frequencies at which sampling shows these lines. A line that "
        "appears here and not over time follows the table."
        "",
        spectra.angle,
    ),
    _Kind(
        "frequency", "Waves in time",
        "Left: spectrum of the residuals of the data sets; dashed: the mean for noise alone. Right: spectrum of "
        "the readings within data sets, divided by white noise; dashed: the limit. A line that appears here and "
        "not over the table angle does not follow the table: its cause may be the mains, a fan or the cycling "
        "of the chamber."
        "",
        spectra.frequency,
    ),
    _Kind(
        "time_in_set", "The first seconds of a data set",
        "Left: mean course of all data sets. Right: the same divided by the step in rate before the data set. "
        "Bands: 95 % interval about zero. A mean that decays in the right panel shows that the gyro or the "
        "table is still settling: wait longer.",
        residual_lines.time_in_set,
    ),
    _Kind(
        "legs", "Difference between heating and cooling",
        "Differences of two data sets at the same rate and temperature: one reached from a lower temperature, "
        "one from a higher. A difference other than zero shows hysteresis, or a part of the gyro that follows "
        "the temperature later than the thermometer; hysteresis becomes smaller towards both ends of the range. "
        "A slope over the rate shows that the scale factor has hysteresis too.",
        residual_lines.legs,
    ),
    _Kind(
        "previous_rate", "Residual against the rate before",
        "A slope or a step at zero shows that the output depends on the previous rate. If the rates were "
        "measured in ascending order, this picture shows the same as the residual over the rate, shifted by one "
        "data set."
        "",
        residual_lines.previous_rate,
    ),
    _Kind(
        "repeats", "Repeated points",
        "Differences of data sets at the same rate and temperature. Dashed: two standard deviations that the "
        "noise model expects of such pairs. Points far outside show an effect that depends on neither rate nor "
        "temperature, or noise that is larger than estimated."
        "",
        noise.repeats,
    ),
    _Kind(
        "allan", "Allan deviation of the static record",
        "Allan deviation of the longest section at rest and at one temperature. The slope -1/2 gives the angle "
        "random walk N, the flat part the bias instability B, the slope +1/2 the rate random walk K. Bars: 95 % "
        "intervals. Dashed: the fitted sum of these terms.",
        noise.allan,
    ),
)  # fmt: skip
LADDER = _Kind(
    "ladder", "Errors of the versions",
    "RMS error of each version on the data of its fit, and on temperatures left out of its fit. Dashed: the "
    "noise floor. An error that falls on the fitted data only is overfitting.",
    noise.ladder,
)  # fmt: skip


COMPARED = (
    _Kind(
        "error_over_rate", "Measured and modelled error of the version, without refitting",
        "The version is applied without refitting. Dots: measured errors. Lines: the model of the version at "
        "each temperature level; blue is cold, red is hot. Rows: outputs; columns: the axis that is turned. "
        "Each panel has its own scale of errors.",
        model_lines.error_over_rate,
    ),
    _Kind(
        "full_turn", "Error after a full turn",
        "Error of the heading after one full turn, for rates of 5 deg/s or more. Left: only the static bias at rest is "
        "subtracted. Right: the calibration is applied, and the remaining static bias is "
        "subtracted. Both plots have the "
        "same scale; blue is cold, red is hot.",
        model_lines.full_turn,
    ),
)  # fmt: skip


def pictures_of(
    criticism: CriticismResponse, ladder: LadderResponse | None = None, comparison: ComparisonResponse | None = None
) -> list[Picture]:
    """Return the pictures of a criticism, a ladder and a comparison, as far as there is something to draw."""
    pictures = [_picture(kind, criticism, _effects(kind.id, criticism)) for kind in KINDS]
    pictures += [_picture(kind, comparison, ()) for kind in COMPARED if comparison is not None]
    if ladder is not None:
        pictures.append(_picture(LADDER, ladder, ()))
    return [picture for picture in pictures if picture is not None]


def _picture(kind: _Kind[AnswerT], answer: AnswerT, effects: tuple[str, ...]) -> Picture | None:
    figure = kind.draw(answer)
    return Picture(kind.id, kind.title, kind.caption, figure, effects) if figure is not None else None


def _effects(view: str, criticism: CriticismResponse) -> tuple[str, ...]:
    views = criticism.views
    draws = views.get("draws") or {}
    if view != "channels":
        return tuple(draws.get(view, ()))
    names = [line["channel"] for line in views.get("channels", ())]
    return tuple(dict.fromkeys(effect for name in names for effect in draws.get(name, ())))
