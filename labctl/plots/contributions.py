"""Contributions to an uncertainty over the rate and over the temperature, one line for each source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

import plotly.graph_objects as go
from plotly.colors import qualitative

from labctl.answers.budget import ContributionLinesJson, ContributionsOverJson
from labctl.plots.theme import INK, grid_of, place

#: Colours of the sources, in the order in which they appear first; the sums are drawn in the colour of the text.
COLOURS = [*qualitative.Safe, *qualitative.Vivid]
#: Room for the legend below the panels.
LEGEND_PX = 140
STYLE = "body { font: 16px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }"


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
    figure = grid_of(titles, 2, horizontal_spacing=0.09)
    every = (lines for one in over.values() for lines in (one["over_rate"], one["over_temperature"]))
    names = list(dict.fromkeys(name for lines in every for name in lines["contributions"]))
    drawn: set[str] = set()
    for row, one in enumerate(over.values()):
        _draw(figure, one["over_rate"], names, drawn, place(2 * row, 2))
        _draw(figure, one["over_temperature"], names, drawn, place(2 * row + 1, 2))
    figure.update_xaxes(title="rate, deg/s", col=1)
    figure.update_xaxes(title="temperature, deg C", col=2)
    figure.update_yaxes(title="standard uncertainty, deg/s", rangemode="tozero", col=1)
    below = {"yref": "container", "y": 0.0, "yanchor": "bottom", "x": 0.0, "xanchor": "left"}
    figure.update_layout(
        showlegend=True, legend=below, margin={"b": LEGEND_PX}, height=figure.layout.height + LEGEND_PX
    )
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


def contributions_html(title: str, over: Mapping[str, ContributionsOverJson], not_stated: Sequence[str]) -> str:
    """Return a page that needs no server: the figure, and which standards are not in it."""
    figure = contributions(over).to_html(full_html=False, include_plotlyjs=True, config={"displaylogo": False})
    note = f"<p>Not stated, and in no line: {escape(', '.join(not_stated))}.</p>" if not_stated else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{escape(title)}</title>\n'
        f"<style>{STYLE}</style></head>\n<body>\n<h1>{escape(title)}</h1>\n{note}\n{figure}\n</body>\n</html>\n"
    )
