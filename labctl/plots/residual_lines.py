"""Residual against what was logged, against time and against what came before, with running means and bands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import plotly.graph_objects as go

from labctl.plots.theme import WARM, banded, colour_of, dots, grid_of, place

HOUR_S = 3600.0
LABELS = {
    "table_rate_dps": "table rate, deg/s",
    "temperature_c": "gyro temperature, deg C",
    "chamber_c": "chamber, deg C",
    "supply_v": "supply, V",
    "power_s": "time since power-on, s",
    "previous_rate_dps": "rate before, deg/s",
    "t_s": "time, h",
    "order": "data sets in order",
}


def label_of(channel: str) -> str:
    """Return what an axis of a figure is called: the column's name where there is no better."""
    return LABELS.get(channel, channel)


def channels(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the residual against every channel; None without any."""
    views = answer.get("views") or {}
    lines = views.get("channels") or []
    if not lines:
        return None
    columns = min(len(lines), 3)
    lines = sorted(lines, key=lambda line: (line["axis"], line["channel"] != "table_rate_dps", line["channel"]))
    drawn = shown_text(views.get("sets") or {})
    figure = grid_of([_title(line) + drawn for line in lines], columns, horizontal_spacing=0.09)
    for panel, line in enumerate(lines):
        where, colour = place(panel, columns), colour_of(line["axis"])
        _dots(figure, views.get("sets") or {}, line, colour, where)
        banded(figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **where)
        figure.update_xaxes(title=label_of(line["channel"]), **where)
    figure.update_yaxes(title="deg/s", col=1)
    return figure


def _title(line: Mapping[str, Any]) -> str:
    position = f", {line['position']} up" if "position" in line else ""
    return f"{line['axis']}{position}: z = {line['z']:.1f}" if line["z"] is not None else f"{line['axis']}{position}"


def shown_text(sets: Mapping[str, Any]) -> str:
    """Return "; n of N data sets drawn" where not every data set is drawn, else nothing."""
    shown, of = len(sets.get("dataset") or ()), sets.get("of", 0)
    return f"; {shown} of {of} data sets drawn" if shown < of else ""


def _dots(
    figure: go.Figure, sets: Mapping[str, Any], line: Mapping[str, Any], colour: str, where: Mapping[str, int]
) -> None:
    values = (sets.get("channels") or {}).get(line["channel"])
    residual = (sets.get("residual_dps") or {}).get(line["axis"])
    if values is None or residual is None:
        return
    rows = [k for k, there in enumerate(sets["position"]) if line.get("position", there) == there]
    dots(
        figure, [values[k] for k in rows], [residual[k] for k in rows], colour,
        [f"data set {sets['dataset'][k]}" for k in rows], **where,
    )  # fmt: skip


def time(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the residual of each axis against time, power-ons as lines, and the temperature below.

    Where no time is known it is against the order of the data sets.
    """
    views = answer.get("views") or {}
    lines, sets = views.get("time") or [], views.get("sets") or {}
    if not lines or not sets:
        return None
    name, unit = ("t_s", HOUR_S) if sets["timed"] else ("order", 1.0)
    along = [value / unit for value in sets["channels"][name]]
    titles = [_time_title(line) + shown_text(sets) for line in lines]
    figure = grid_of([*titles, "temperature"], 1, shared_xaxes=True)
    for panel, line in enumerate(lines):
        where, colour = place(panel, 1), colour_of(line["axis"])
        dots(
            figure,
            along,
            sets["residual_dps"][line["axis"]],
            colour,
            [f"data set {n}" for n in sets["dataset"]],
            **where,
        )
        at = [value / unit for value in line[name]]
        banded(figure, at, line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **where)
        for begin in line[f"power_on_{name}"]:
            figure.add_vline(x=begin / unit, line={"color": WARM, "width": 1, "dash": "dot"}, **where)
        figure.update_yaxes(title="deg/s", **where)
    where = place(len(lines), 1)
    figure.add_trace(
        go.Scatter(
            x=along, y=sets["channels"]["temperature_c"], mode="lines", line={"color": WARM}, name="temperature"
        ),
        **where,
    )
    figure.update_yaxes(title="deg C", **where)
    figure.update_xaxes(title=label_of(name), **where)
    return figure


def _time_title(line: Mapping[str, Any]) -> str:
    said = [f"{word} {line[key]:.2g}" for word, key in (("lag-1", "lag1_whitened"), ("runs p", "runs_p"))
            if line[key] is not None]  # fmt: skip
    return f"{line['axis']}: {', '.join(said)} (drift taken out)" if said else str(line["axis"])


def previous_rate(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the residual against the rate before; None where it is not known."""
    views = answer.get("views") or {}
    lines = views.get("previous_rate") or []
    if not lines:
        return None
    columns = min(len(lines), 3)
    drawn = shown_text(views.get("sets") or {})
    figure = grid_of([_title(line) + drawn for line in lines], columns)
    for panel, line in enumerate(lines):
        where, colour = place(panel, columns), colour_of(line["axis"])
        _dots(figure, views.get("sets") or {}, {**line, "channel": "previous_rate_dps"}, colour, where)
        banded(figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **where)
    figure.update_xaxes(title=label_of("previous_rate_dps"))
    figure.update_yaxes(title="deg/s", col=1)
    return figure


def legs(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the residual reached from below minus that from above, by temperature and rate; None without both."""
    lines = (answer.get("views") or {}).get("legs") or []
    if not lines:
        return None
    figure = grid_of([_title(line) for line in lines], 2)
    for panel, line in enumerate(lines):
        where, colour = place(panel, 2), colour_of(line["axis"])
        banded(figure, line["at"], line["mean_dps"], line["low_dps"], line["high_dps"], colour, line["axis"], **where)
        figure.update_xaxes(title=label_of(line["channel"]), **where)
    figure.update_yaxes(title="up - down, deg/s", col=1)
    return figure


def time_in_set(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the mean course within data sets, plain and by the step in rate; None for means."""
    lines = (answer.get("views") or {}).get("time_in_set") or []
    if not lines:
        return None
    figure = grid_of(["mean of all data sets", "by the step in rate before"], 2, horizontal_spacing=0.12)
    for line in lines:
        colour = colour_of(line["axis"])
        for panel, (values, band) in enumerate((("mean_dps", "band_dps"), ("per_step", "per_step_band"))):
            if values not in line:
                continue
            low, high = ([sign * b for b in line[band]] for sign in (-1, 1))
            banded(figure, line["since_s"], line[values], low, high, colour, line["axis"], **place(panel, 2))
    figure.update_xaxes(title="time in the data set, s")
    figure.update_yaxes(title="deg/s", col=1)
    figure.update_yaxes(title="deg/s per deg/s of step", col=2)
    return figure
