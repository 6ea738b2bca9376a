"""The page of a reproduced paper: printed numbers beside reproduced ones, and the figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

import plotly.graph_objects as go

from labctl.answers.reproduction import PaperFigure, PaperNumber, PaperPage, PaperPanel, PaperTrace
from labctl.plots.page import figure_part, table_part, whole_page
from labctl.plots.registry import Picture
from labctl.plots.temperature_scale import TEMPERATURE_SCALE
from labctl.plots.theme import ACCENT, INK, SCALE, WARM, grid_of, place

COLOURS = (ACCENT, WARM, "#3a9d6e", "#8a63c7", INK, "#b3242f")
NONE = "–"
HEAD = ("quantity", "unit", "printed", "made from", "origin", "reproduced", "difference", "why")
#: Room for the names of the lines, above the panels.
LEGEND_PX = 30
#: Sizes of a measured point, of one in a map, and of a cell of a modelled map.
POINT_PX, MAP_PX, CELL_PX = 5, 6, 17


def paper_html(page: PaperPage) -> str:
    """Return the page as one HTML document that needs no server and no network."""
    pictures = [Picture(f["id"], f["title"], f["caption"], paper_figure(f)) for f in page["figures"]]
    parts = [
        f"<h1>{escape(page['title'])}</h1>",
        f'<p class="soft">{escape(page["citation"])}</p>',
        *(f"<p>{escape(line)}</p>" for line in page["sources"]),
        *(f"<p>{escape(line)}</p>" for line in page["story"]),
        *_numbers(page["numbers"]),
        "<h2>Where the paper contradicts itself or leaves a choice</h2>" if page["contradictions"] else "",
        table_part(("place", "what the printed numbers show", "what is done here"), page["contradictions"], (1, 2)),
        "<h2>What could not be made</h2>" if page["missing"] else "",
        table_part(("what", "why", "what to record"), page["missing"], (1, 2)),
        *map(figure_part, pictures),
    ]
    return whole_page(page["title"], parts, drawn=bool(pictures))


def _numbers(numbers: Sequence[PaperNumber]) -> Iterator[str]:
    """Yield a title and a table for each place, in the paper's order."""
    for at in dict.fromkeys(number["place"] for number in numbers):
        rows = [
            (
                n["quantity"], n["unit"], _said(n), n["of"], n["origin"], _number(n["reproduced"]),
                _number(n["difference"]), n["why"],
            )
            for n in numbers if n["place"] == at
        ]  # fmt: skip
        yield f"<h2>{escape(at)}</h2>"
        yield table_part(HEAD, rows, (1, 3, 4, 7))


def _said(number: PaperNumber) -> str:
    value = _number(number["printed"])
    return f"{number['relation']} {value}" if number["relation"] and value != NONE else value


def _number(value: float | None) -> str:
    return NONE if value is None else f"{value:.5g}"


def paper_figure(figure: PaperFigure) -> go.Figure:
    """Return a figure as a plot: every point of its numbers is drawn."""
    panels, columns = figure["panels"], figure["columns"]
    drawn = grid_of([panel["title"] for panel in panels], columns, horizontal_spacing=0.27 / columns)
    shown_names: set[str] = set()
    one_scale = len({panel["colour_title"] for panel in panels}) == 1
    for index, panel in enumerate(panels):
        placement, scale = place(index, columns), "coloraxis" if one_scale else f"coloraxis{index + 1}"
        for number, trace in enumerate(panel["traces"]):
            drawn_trace = _trace(panel, trace, COLOURS[number % len(COLOURS)], scale)
            drawn_trace.showlegend = _named(panel) and trace["name"] not in shown_names
            shown_names.add(trace["name"])
            drawn.add_trace(drawn_trace, **placement)
        below = panels[index + columns : index + columns + 1]
        if not below or below[0]["x_title"] != panel["x_title"]:
            drawn.update_xaxes(title=panel["x_title"], **placement)
        drawn.update_yaxes(title=panel["y_title"], **placement)
        if panel["colour_title"] and not one_scale:
            subplot = drawn.get_subplot(**placement)
            drawn.update_layout({scale: _scale([panel], subplot.xaxis.domain[1], subplot.yaxis.domain)})
    if one_scale and panels[0]["colour_title"]:
        drawn.update_layout(coloraxis=_scale(panels, 1.0, (0.0, 1.0)))
    if any(map(_named, panels)):
        legend = {"orientation": "h", "yref": "container", "y": 0.99, "yanchor": "top", "x": 0.0, "xanchor": "left"}
        height = drawn.layout.height + LEGEND_PX
        drawn.update_layout(showlegend=True, legend=legend, height=height, margin={"t": 50 + LEGEND_PX})
    return drawn


def _named(panel: PaperPanel) -> bool:
    return len(panel["traces"]) > 1 and not panel["colour_title"]


def _trace(panel: PaperPanel, trace: PaperTrace, colour: str, scale: str) -> go.Scatter:
    hover = f"%{{x:.5g}}, %{{y:.5g}}<br>{trace['name']}<extra></extra>"
    shared = {
        "x": trace["x"], "y": trace["y"], "name": trace["name"], "hovertemplate": hover, "legendgroup": trace["name"],
    }  # fmt: skip
    if trace["kind"] in {"line", "dashes"}:
        line = {
            "color": INK if panel["colour_title"] else colour,
            "dash": "dash" if trace["kind"] == "dashes" else None,
        }
        return go.Scatter(mode="lines", line=line, **shared)
    values = trace.get("colour")
    marker: dict[str, object] = {"size": POINT_PX, "color": colour}
    if values is not None:
        marker = {"size": POINT_PX, "color": values, "coloraxis": scale}
        if panel["scale"] == "error":
            marker |= {"symbol": "square", "size": CELL_PX if trace["kind"] == "cells" else MAP_PX}
    return go.Scatter(mode="markers", marker=marker, **shared)


def _scale(panels: Sequence[PaperPanel], right: float, span: tuple[float, float]) -> dict[str, object]:
    """Return the colour axis of panels; its bar stands at their right end, over a span of the figure's height."""
    values = [value for panel in panels for trace in panel["traces"] for value in trace.get("colour", ())]
    low, high = span
    bar = {
        "title": {"text": panels[0]["colour_title"], "side": "right"}, "x": right, "xanchor": "left", "thickness": 10,
        "y": (low + high) / 2, "len": high - low,
    }  # fmt: skip
    if panels[0]["scale"] == "temperature":
        return {"colorscale": TEMPERATURE_SCALE, "colorbar": bar}
    most = max((abs(value) for value in values), default=1.0)
    return {"colorscale": SCALE, "cmin": -most, "cmax": most, "colorbar": bar}
