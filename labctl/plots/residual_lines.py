"""Residual against what was logged, against time and against what came before, with running means and bands."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from labctl.answers.criticism import CriticismResponse
from labctl.answers.views import DataSetColumns, Numbers, TimeLine
from labctl.plots.theme import WARM, banded, colour_of, dots, grid_of, place

HOUR_S = 3600.0
LABELS = {
    "table_rate_dps": "table rate, deg/s",
    "temperature_c": "gyro temperature, deg C",
    "chamber_c": "chamber, deg C",
    "reference_c": "reference temperature, deg C",
    "own_temperature_c": "gyro's own thermometer, deg C",
    "humidity_pct": "relative humidity, %",
    "supply_v": "supply, V",
    "power_s": "time since power-on, s",
    "previous_rate_dps": "rate before, deg/s",
    "t_s": "time, h",
    "order": "data sets in order",
}


def label_of(channel: str) -> str:
    """Return what an axis of a figure is called: the column's name where there is no better."""
    return LABELS.get(channel, channel)


def channels(answer: CriticismResponse) -> go.Figure | None:
    """Return the residual against every channel; None without any."""
    views = answer.views
    lines = views.get("channels") or []
    if not lines:
        return None
    columns = min(len(lines), 3)
    lines = sorted(lines, key=lambda line: (line["axis"], line["channel"] != "table_rate_dps", line["channel"]))
    drawn = shown_text(views.get("sets") or DataSetColumns())
    titles = [_title(line["axis"], line["z"], line.get("position")) + drawn for line in lines]
    figure = grid_of(titles, columns, horizontal_spacing=0.09)
    for panel, line in enumerate(lines):
        placement, colour = place(panel, columns), colour_of(line["axis"])
        _dots(
            figure,
            views.get("sets") or DataSetColumns(),
            line["axis"],
            line["channel"],
            line.get("position"),
            placement,
        )
        banded(
            figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **placement
        )
        figure.update_xaxes(title=label_of(line["channel"]), **placement)
    figure.update_yaxes(title="deg/s", col=1)
    return figure


def _title(axis: str, z: float | None, position: str | None = None) -> str:
    place_text = axis if position is None else f"{axis}, {position} up"
    return place_text if z is None else f"{place_text}: z = {z:.1f}"


def shown_text(sets: DataSetColumns) -> str:
    """Return "; n of N data sets drawn" where not every data set is drawn, else nothing."""
    n_shown, of = len(sets.get("dataset") or ()), sets.get("of", 0)
    return f"; {n_shown} of {of} data sets drawn" if n_shown < of else ""


def _dots(
    figure: go.Figure, sets: DataSetColumns, axis: str, channel: str, position: str | None, placement: Mapping[str, int]
) -> None:
    values = (sets.get("channels") or {}).get(channel)
    residual = (sets.get("residual_dps") or {}).get(axis)
    if values is None or residual is None:
        return
    rows = [k for k, row_position in enumerate(sets.get("position", ())) if position in {None, row_position}]
    numbers = sets.get("dataset", [])
    dots(
        figure, [values[k] for k in rows], [residual[k] for k in rows], colour_of(axis),
        [f"data set {numbers[k]}" for k in rows], **placement,
    )  # fmt: skip


def time(answer: CriticismResponse) -> go.Figure | None:
    """Return the residual of each axis against time, power-ons as lines, and the temperature below.

    Where no time is known it is against the order of the data sets. None where there is nothing to draw.
    """
    views = answer.views
    lines, sets = views.get("time") or [], views.get("sets") or DataSetColumns()
    if not lines or not sets:
        return None
    timed = sets.get("timed", False)
    name, per = ("t_s", HOUR_S) if timed else ("order", 1.0)
    channels = sets.get("channels", {})
    residuals, numbers = sets.get("residual_dps", {}), [f"data set {n}" for n in sets.get("dataset", ())]
    along = _over(channels[name], per)
    titles = [_time_title(line) + shown_text(sets) for line in lines]
    figure = grid_of([*titles, "temperature"], 1, shared_xaxes=True)
    for panel, line in enumerate(lines):
        placement, colour = place(panel, 1), colour_of(line["axis"])
        dots(figure, along, residuals[line["axis"]], colour, numbers, **placement)
        at, begins = (
            (line.get("t_s", []), line.get("power_on_t_s", []))
            if timed
            else (line.get("order", []), line.get("power_on_order", []))
        )
        mean, low, high = line["mean_dps"], line["low_dps"], line["high_dps"]
        banded(figure, _over(at, per), mean, low, high, colour, line["axis"], **placement)
        for begin in _over(begins, per):
            figure.add_vline(x=begin, line={"color": WARM, "width": 1, "dash": "dot"}, **placement)
        figure.update_yaxes(title="deg/s", **placement)
    placement = place(len(lines), 1)
    figure.add_trace(
        go.Scatter(x=along, y=channels["temperature_c"], mode="lines", line={"color": WARM}, name="temperature"),
        **placement,
    )
    figure.update_yaxes(title="deg C", **placement)
    figure.update_xaxes(title=label_of(name), **placement)
    return figure


def _over(values: Numbers, per: float) -> Numbers:
    return [None if value is None else value / per for value in values]


def _time_title(line: TimeLine) -> str:
    figures = (("lag-1", line["lag1_whitened"]), ("runs p", line["runs_p"]))
    parts = [f"{word} {figure:.2g}" for word, figure in figures if figure is not None]
    return f"{line['axis']}: {', '.join(parts)} (drift taken out)" if parts else line["axis"]


def previous_rate(answer: CriticismResponse) -> go.Figure | None:
    """Return the residual against the rate before; None where it is not known."""
    views = answer.views
    lines = views.get("previous_rate") or []
    if not lines:
        return None
    columns = min(len(lines), 3)
    drawn = shown_text(views.get("sets") or DataSetColumns())
    figure = grid_of([_title(line["axis"], line["z"]) + drawn for line in lines], columns)
    for panel, line in enumerate(lines):
        placement, colour = place(panel, columns), colour_of(line["axis"])
        _dots(figure, views.get("sets") or DataSetColumns(), line["axis"], "previous_rate_dps", None, placement)
        banded(
            figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **placement
        )
    figure.update_xaxes(title=label_of("previous_rate_dps"))
    figure.update_yaxes(title="deg/s", col=1)
    return figure


def legs(answer: CriticismResponse) -> go.Figure | None:
    """Return the residual reached from below minus that from above, by temperature and rate; None without both."""
    lines = answer.views.get("legs") or []
    if not lines:
        return None
    figure = grid_of([_title(line["axis"], line["z"]) for line in lines], 2)
    for panel, line in enumerate(lines):
        placement, colour = place(panel, 2), colour_of(line["axis"])
        banded(
            figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **placement
        )
        figure.update_xaxes(title=label_of(line["channel"]), **placement)
    figure.update_yaxes(title="up - down, deg/s", col=1)
    return figure


def time_in_set(answer: CriticismResponse) -> go.Figure | None:
    """Return the mean course within data sets, plain and by the step in rate; None for means."""
    lines = answer.views.get("time_in_set") or []
    if not lines:
        return None
    figure = grid_of(["mean of all data sets", "by the step in rate before"], 2, horizontal_spacing=0.12)
    for line in lines:
        colour = colour_of(line["axis"])
        courses = ((line["mean_dps"], line["band_dps"]), (line.get("per_step"), line.get("per_step_band")))
        for panel, (mean, band) in enumerate(courses):
            if mean is None or band is None:
                continue
            low, high = ([None if b is None else sign * b for b in band] for sign in (-1, 1))
            banded(figure, line["since_s"], mean, low, high, colour, line["axis"], **place(panel, 2))
    figure.update_xaxes(title="time in the data set, s")
    figure.update_yaxes(title="deg/s", col=1)
    figure.update_yaxes(title="deg/s per deg/s of step", col=2)
    return figure
