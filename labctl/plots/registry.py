"""Which pictures there are, in which order, and how to read each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import plotly.graph_objects as go

from labctl.json_types.answers import ComparisonJson, CriticismJson, LadderJson
from labctl.json_types.views import Views
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
        "Each cell is the mean residual of its data sets over the noise floor, and every measured cell is drawn; "
        "red: measured error above the model, blue: below it; the same colour scale in all maps."
        " Data sets share a cell where rate and temperature "
        "repeat within 0.1 % and 0.25 K. Dimmed cells are less than two noise floors from zero: a single one is not "
        "significant."
        " A "
        "column that is coloured from top to bottom depends on the rate, a row on the temperature, one corner on both.",
        residual_maps.maps,
    ),
    _Kind(
        "channels", "Residual against every logged channel",
        "Dots are data sets, the line is their running mean (or the mean at each level), the band its 95 % interval, "
        "with the drift between data sets taken into account. Where the band excludes zero, the error depends on "
        "this channel, or on another that changes together with it, as time and temperature do when the temperature "
        "only rises."
        "",
        residual_lines.channels,
    ),
    _Kind(
        "time", "Residual against time",
        "Dotted lines are power-ons; the temperature is below; without times, the data sets in order. A slope is "
        "drift, a step at a power-on or a re-mounting is a shift, a decay after a power-on is warm-up. Lag-1 and the "
        "runs test are of the residuals after the drift that the noise model knows is taken out: a small p means "
        "that successive residuals are still correlated."
        "",
        residual_lines.time,
    ),
    _Kind(
        "angle", "Waves in the table angle, within data sets",
        "Mean power over white noise by cycles per turn; a bar above the dashed limit is a line (about 5 % chance of "
        "one anywhere in a panel with nothing there). Once per turn: Earth's rate, a magnetic field or a tilt; four "
        "per turn: the gear. The stepper's own lines (50 and 200 per turn) and, where the latitude is known, the "
        "Earth's are taken out: bars well below 1 are the frequencies to which sampling aliased them. A line that "
        "appears here and not over time follows the table."
        "",
        spectra.angle,
    ),
    _Kind(
        "frequency", "Waves in time",
        "Left: the data sets' residuals as waves, dashed what noise alone gives on average. Right: readings within "
        "data sets over white noise, dashed the limit. A line that appears here and not over the angle follows a "
        "clock, not the table: mains, a fan, the chamber's cycling."
        "",
        spectra.frequency,
    ),
    _Kind(
        "time_in_set", "The first seconds of a data set",
        "The mean course of all data sets, and the same by the step in rate that went before; bands are 95 % about "
        "zero. A mean that decays in the right panel shows that the gyro or the table is still settling: wait longer.",
        residual_lines.time_in_set,
    ),
    _Kind(
        "legs", "From below minus from above",
        "Pairs of data sets at one rate and temperature, once reached from a lower temperature and once from a higher. "
        "Off zero: hysteresis, or a part that follows the temperature later than the thermometer; hysteresis closes "
        "towards both ends of "
        "the range. A slope over rate means that the scale factor has hysteresis too.",
        residual_lines.legs,
    ),
    _Kind(
        "previous_rate", "Residual against the rate before",
        "A slope or a step at zero means that the output depends on the previous rate. With rates in rising order "
        "this picture is that over the rate itself, shifted by one data set."
        "",
        residual_lines.previous_rate,
    ),
    _Kind(
        "repeats", "Repeated points",
        "Differences of data sets at one rate and temperature; dashed are two standard deviations of what the noise "
        "model gives neighbours like these. Points far outside: an effect that depends on neither rate nor "
        "temperature, or noise that is larger than estimated."
        "",
        noise.repeats,
    ),
    _Kind(
        "allan", "Allan deviation of the static record",
        "The longest section at rest and at one temperature. Slope -1/2 is angle random walk N, the flat part bias "
        "instability B, slope +1/2 rate random walk K; bars are 95 % intervals, dashed the fitted sum of the terms.",
        noise.allan,
    ),
)  # fmt: skip
LADDER = _Kind(
    "ladder", "Errors of the versions",
    "Each version's RMS error on the data of its fit and on temperatures left out of its fit; dashed the noise floor. "
    "An error that falls on the fitted data only is overfitting.",
    noise.ladder,
)  # fmt: skip


COMPARED = (
    _Kind(
        "error_over_rate", "Measured and modelled error of the version, without refitting",
        "Nothing is refitted here. Dots are measured, lines are the version's model at each temperature level: blue is "
        "cold, red is hot. Rows are outputs, columns the axis that is turned; each panel has its own scale of errors.",
        model_lines.error_over_rate,
    ),
    _Kind(
        "full_turn", "Error after a full turn",
        "How far a heading is off after one turn, from 5 deg/s on: left with only the static bias at rest "
        "subtracted, right with the calibration applied and its remaining static bias subtracted, both on the same axes"
        "; blue is cold, red is "
        "hot.",
        model_lines.full_turn,
    ),
)  # fmt: skip


def pictures_of(
    criticism: CriticismJson, ladder: LadderJson | None = None, comparison: ComparisonJson | None = None
) -> list[Picture]:
    """Return the pictures of a criticism, a ladder and a comparison, as far as there is something to draw.

    All three as JSON.
    """
    found = [_picture(kind, criticism, _effects(kind.id, criticism)) for kind in KINDS]
    found += [_picture(kind, comparison, ()) for kind in COMPARED if comparison is not None]
    if ladder is not None:
        found.append(_picture(LADDER, ladder, ()))
    return [picture for picture in found if picture is not None]


def _picture(kind: _Kind[AnswerT], answer: AnswerT, effects: tuple[str, ...]) -> Picture | None:
    figure = kind.draw(answer)
    return Picture(kind.id, kind.title, kind.caption, figure, effects) if figure is not None else None


def _effects(view: str, criticism: CriticismJson) -> tuple[str, ...]:
    views = criticism.get("views") or Views()
    draws = views.get("draws") or {}
    if view != "channels":
        return tuple(draws.get(view, ()))
    names = [line["channel"] for line in views.get("channels", ())]
    return tuple(dict.fromkeys(effect for name in names for effect in draws.get(name, ())))
