"""Waves in the table angle beside waves in time: what follows the table is a line in one, a clock in the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import plotly.graph_objects as go

from labctl.answers.criticism import CriticismResponse
from labctl.answers.views import AngleSpectrum, Numbers
from labctl.plots.theme import INK, colour_of, grid_of, place


def angle(answer: CriticismResponse) -> go.Figure | None:
    """Return the periodogram in table angle; None where no angle was logged."""
    lines = answer.views.get("angle") or []
    if not lines:
        return None
    figure = grid_of([_lines_text(line) for line in lines], 1)
    for panel, line in enumerate(lines):
        placement = place(panel, 1)
        _stems(figure, line["cycles_per_turn"], line["over_white"], line, placement)
        figure.update_yaxes(title="over white noise", rangemode="tozero", **placement)
    figure.update_xaxes(title="cycles per turn of the table")
    return figure


def _lines_text(line: AngleSpectrum) -> str:
    above = ", ".join(f"{w['cycles_per_turn']} per turn {w['amplitude_dps']:.2g} deg/s" for w in line["lines"][:3])
    return f"{line['axis']}: {above or 'no line above the limit'}"


def _stems(figure: go.Figure, x: list[int], y: Numbers, line: AngleSpectrum, placement: Mapping[str, int]) -> None:
    figure.add_trace(
        go.Bar(x=x, y=y, marker={"color": colour_of(line["axis"])}, name=line["axis"],
               hovertemplate="%{x} per turn: %{y:.2f}<extra></extra>"),
        **placement,
    )  # fmt: skip
    _limit(figure, x, line["limit"], placement)


def _limit(figure: go.Figure, x: Sequence[float | None], y: Numbers, placement: Mapping[str, int]) -> None:
    figure.add_trace(
        go.Scatter(x=x, y=y, mode="lines", line={"color": INK, "dash": "dash", "width": 1}, name="limit"), **placement
    )


def frequency(answer: CriticismResponse) -> go.Figure | None:
    """Return the periodograms in time, within data sets and between them; None where there is neither."""
    views = answer.views
    within, between = views.get("frequency_within") or [], views.get("frequency") or []
    if not within and not between:
        return None
    figure = grid_of(["between data sets", "within data sets"], 2, horizontal_spacing=0.12)
    for line in between:
        colour, placement = colour_of(line["axis"]), place(0, 2)
        x = line["per_hour"]
        figure.add_trace(
            go.Scatter(x=x, y=line["amplitude_dps"], mode="lines", line={"color": colour}, name=line["axis"]),
            **placement,
        )
        figure.add_trace(
            go.Scatter(x=x, y=line["noise_dps"], mode="lines", line={"color": colour, "dash": "dash", "width": 1},
                       name=f"{line['axis']}: noise"),
            **placement,
        )  # fmt: skip
    for spectrum in within:
        placement = place(1, 2)
        colour = colour_of(spectrum["axis"])
        figure.add_trace(
            go.Scatter(
                x=spectrum["hz"], y=spectrum["over_white"], mode="lines", line={"color": colour}, name=spectrum["axis"]
            ),
            **placement,
        )
        _limit(figure, spectrum["hz"], spectrum["limit"], placement)
    figure.update_xaxes(type="log", title="cycles per hour", col=1)
    figure.update_xaxes(title="Hz", col=2)
    figure.update_yaxes(type="log", title="amplitude, deg/s", col=1)
    figure.update_yaxes(title="over white noise", rangemode="tozero", col=2)
    return figure
