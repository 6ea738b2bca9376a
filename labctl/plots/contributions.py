"""Contributions to an uncertainty over the rate and over the temperature, one line for each source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import plotly.graph_objects as go
from plotly.colors import qualitative

from labctl.answers.budget import ContributionLinesJson, ContributionsOverJson
from labctl.plots.page import figure_part, whole_page
from labctl.plots.registry import Picture
from labctl.plots.theme import INK, grid_of, place

#: Colours of the sources, in the order in which they appear first; the sums are drawn in the colour of the text.
COLOURS = [*qualitative.Safe, *qualitative.Vivid]
#: Room for the axis below the panels, and for each line of the legend under it.
AXIS_PX, LEGEND_LINE_PX = 70, 20
#: Names of so many characters stand two in a line of the legend on a phone.
TWO_IN_A_LINE = 16
TITLE = "Contributions over rate and over temperature"
CAPTION = "One line for each source of uncertainty, and for their sums; a source that is not stated has no line."


def contributions(over: Mapping[str, ContributionsOverJson]) -> go.Figure:
    """Return two panels for each axis: contributions over the rate, and over the temperature, deg/s.

    Every source with a known contribution is drawn, also where it is 0; one that is not stated has no line.
    """
    titles = [
        title
        for axis, one in over.items()
        for title in (
            f"axis {axis} at {one['temperature_c']:.3g} deg C",
            f"axis {axis} at {one['rate_dps']:.4g} deg/s",
        )
    ]
    figure = grid_of(titles, 1)
    every = (lines for one in over.values() for lines in (one["over_rate"], one["over_temperature"]))
    names = list(dict.fromkeys(name for lines in every for name in lines["contributions"]))
    drawn: set[str] = set()
    for row, one in enumerate(over.values()):
        _draw(figure, one["over_rate"], names, drawn, place(2 * row, 1))
        _draw(figure, one["over_temperature"], names, drawn, place(2 * row + 1, 1))
        figure.update_xaxes(title="rate, deg/s", **place(2 * row, 1))
        figure.update_xaxes(title="temperature, deg C", **place(2 * row + 1, 1))
    figure.update_yaxes(title="standard uncertainty, deg/s", rangemode="tozero")
    in_a_line = 2 if max(map(len, drawn), default=0) <= TWO_IN_A_LINE else 1
    below_px = AXIS_PX + LEGEND_LINE_PX * -(-len(drawn) // in_a_line)
    below = {"yref": "container", "y": 0.0, "yanchor": "bottom", "x": 0.0, "xanchor": "left", "tracegroupgap": 0}
    figure.update_layout(showlegend=True, legend=below, margin={"b": below_px}, height=figure.layout.height + below_px)
    return figure


def _draw(
    figure: go.Figure, lines: ContributionLinesJson, names: Sequence[str], drawn: set[str], placement: dict[str, int]
) -> None:
    sums = {"combined u": lines["combined"], "expanded U": lines["expanded"]}
    dashes = {"combined u": "solid", "expanded U": "dash"}
    for name, values in {**lines["contributions"], **sums}.items():
        if all(value is None for value in values):
            continue
        colour = INK if name in sums else COLOURS[names.index(name) % len(COLOURS)]
        figure.add_trace(
            go.Scatter(
                x=lines["at"], y=values, mode="lines" if len(lines["at"]) > 1 else "markers",
                name=f"{name}, deg/s", legendgroup=name, showlegend=name not in drawn,
                line={"color": colour, "dash": dashes.get(name, "solid"), "width": 2.5 if name in sums else 1.5},
                hovertemplate=f"{escape(name)}<br>%{{x:.5g}}: %{{y:.3g}} deg/s<extra></extra>",
            ),
            **placement,
        )  # fmt: skip
        drawn.add(name)


def contributions_html(
    title: str, over: Mapping[str, ContributionsOverJson], not_stated: Sequence[str], remedy: str = ""
) -> str:
    """Return a page that needs no server: the figure, and which standards are not in it and what brings them there."""
    text = f"Not stated, and in no line: {', '.join(not_stated)}. {remedy}".rstrip()
    note = f"<p>{escape(text)}</p>" if not_stated else ""
    drawn = figure_part(Picture("contributions", TITLE, CAPTION, contributions(over)))
    return whole_page(title, [f"<h1>{escape(title)}</h1>", note, drawn], drawn=True)
