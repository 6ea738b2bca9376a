"""The page of a reproduced paper: printed numbers beside reproduced ones, and the figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

import plotly.graph_objects as go

from labctl.json_types.reproduction import PaperFigure, PaperNumber, PaperPage, PaperPanel, PaperTrace
from labctl.plots.page import figure_part, table_part, whole_page
from labctl.plots.registry import Picture
from labctl.plots.temperature_scale import TEMPERATURE_SCALE
from labctl.plots.theme import ACCENT, INK, SCALE, WARM, grid_of, place

COLOURS = (ACCENT, WARM, "#3a9d6e", "#8a63c7", INK, "#b3242f")
NONE = "–"
#: Room for the names of the lines, above the panels.
LEGEND_PX = 30
#: Sizes of a measured point, of one in a map, and of a cell of a modelled map.
POINT_PX, MAP_PX, CELL_PX = 5, 6, 12


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
        table_part(("place", "what the numbers say", "what is done here"), page["contradictions"], (1, 2)),
        "<h2>What could not be made</h2>" if page["missing"] else "",
        table_part(("what", "why", "what to record"), page["missing"], (1, 2)),
        *map(figure_part, pictures),
    ]
    return whole_page(page["title"], parts, drawn=bool(pictures))


def _numbers(numbers: Sequence[PaperNumber]) -> Iterator[str]:
    """Return a table for each place, in the paper's order."""
    for at in dict.fromkeys(number["place"] for number in numbers):
        rows = [
            (
                n["quantity"], n["unit"], _said(n), n["of"], _number(n["reproduced"]), _number(n["difference"]),
                n["why"],
            )
            for n in numbers if n["place"] == at
        ]  # fmt: skip
        yield f"<h2>{escape(at)}</h2>"
        yield table_part(
            ("quantity", "unit", "printed", "made from", "reproduced", "difference", "why"), rows, (1, 3, 6)
        )


def _said(number: PaperNumber) -> str:
    value = _number(number["printed"])
    return f"{number['relation']} {value}" if number["relation"] and value != NONE else value


def _number(value: float | None) -> str:
    return NONE if value is None else f"{value:.5g}"


def paper_figure(figure: PaperFigure) -> go.Figure:
    """Return a figure as a plot: every point of its numbers is drawn."""
    panels, columns = figure["panels"], figure["columns"]
    drawn = grid_of([panel["title"] for panel in panels], columns, horizontal_spacing=0.27 / columns)
    shown: set[str] = set()
    for index, panel in enumerate(panels):
        where = place(index, columns)
        for number, trace in enumerate(panel["traces"]):
            made = _trace(panel, trace, COLOURS[number % len(COLOURS)], f"coloraxis{index + 1}")
            made.showlegend = _named(panel) and trace["name"] not in shown
            shown.add(trace["name"])
            drawn.add_trace(made, **where)
        drawn.update_xaxes(title=panel["x_title"], **where)
        drawn.update_yaxes(title=panel["y_title"], **where)
        if panel["colour_title"]:
            drawn.update_layout({f"coloraxis{index + 1}": _scale(panel, drawn, where)})
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


def _scale(panel: PaperPanel, drawn: go.Figure, where: dict[str, int]) -> dict[str, object]:
    """Return a colour axis whose bar stands beside its own panel."""
    values = [value for trace in panel["traces"] for value in trace.get("colour", ())]
    subplot = drawn.get_subplot(**where)
    right, (low, high) = subplot.xaxis.domain[1], subplot.yaxis.domain
    bar = {
        "title": {"text": panel["colour_title"], "side": "right"}, "x": right, "xanchor": "left", "thickness": 10,
        "y": (low + high) / 2, "len": high - low,
    }  # fmt: skip
    if panel["scale"] == "temperature":
        return {"colorscale": TEMPERATURE_SCALE, "colorbar": bar}
    most = max((abs(value) for value in values), default=1.0)
    return {"colorscale": SCALE, "cmin": -most, "cmax": most, "colorbar": bar}
