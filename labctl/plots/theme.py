"""How all figures look: neutral, readable on a light and on a dark page, one colour for each axis of the gyro."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from labctl.answers.views import Numbers

INK = "#7d8590"
GRID = "rgba(128,128,128,0.25)"
ACCENT = "#3b82c4"
WARM = "#e07b39"
AXIS_COLOURS = {"x": "#3b82c4", "y": "#e07b39", "z": "#3a9d6e"}
BAND_OPACITY = 0.22
#: Residual over floor, the same in every map: blue below, red above, grey where there is nothing.
SCALE = [[0.0, "#1f5fa8"], [0.35, "#8db3d9"], [0.5, "#a8a8a8"], [0.65, "#dd9a8b"], [1.0, "#b3242f"]]
#: Where that scale ends: at the largest of all maps, but neither below nor above these.
SCALE_LIMITS = (3.0, 10.0)
#: Where a residual is less than this many floors from 0 it is dimmed.
DIMMED_BELOW = 2.0
ROW_PX = 260
GAP_PX = 100

AXIS = {"gridcolor": GRID, "zerolinecolor": INK, "linecolor": INK, "automargin": True, "exponentformat": "power"}
TEMPLATE = go.layout.Template(
    layout={
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": INK, "family": "system-ui, sans-serif", "size": 12},
        "xaxis": AXIS,
        "yaxis": AXIS,
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 1.0, "xanchor": "right"},
        "margin": {"l": 60, "r": 20, "t": 50, "b": 45},
        "hovermode": "closest",
    }
)


def grid_of(
    titles: Sequence[str], columns: int = 1, *, row_px: float = ROW_PX, gap_px: float = GAP_PX, **subplots: object
) -> go.Figure:
    """Return an empty figure with a panel for each title, row by row; `gap_px` of each row are between panels."""
    rows = max(-(-len(titles) // columns), 1)
    height = row_px * rows + 90
    figure = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=list(titles),
        vertical_spacing=min(gap_px / height, 0.9 / rows),
        **subplots,
    )
    figure.update_layout(template=TEMPLATE, height=height, showlegend=False)
    return figure


def place(panel: int, columns: int) -> dict[str, int]:
    """Return row and column of a panel, counted from 0."""
    return {"row": panel // columns + 1, "col": panel % columns + 1}


def colour_of(axis: str) -> str:
    """Return the colour of an axis of the gyro."""
    return AXIS_COLOURS.get(axis, INK)


def translucent(colour: str, opacity: float = BAND_OPACITY) -> str:
    """Return a colour #rrggbb with an opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def banded(
    figure: go.Figure, at: Numbers, mean: Numbers, low: Numbers, high: Numbers, colour: str,
    name: str, **where: int,
) -> None:  # fmt: skip
    """Draw a line with its band."""
    figure.add_trace(
        go.Scatter(
            x=[*at, *reversed(at)], y=[*high, *reversed(low)], fill="toself", fillcolor=translucent(colour),
            line={"width": 0}, hoverinfo="skip", showlegend=False, name=f"{name}: 95 %", mode="lines",
        ),
        **where,
    )  # fmt: skip
    figure.add_trace(
        go.Scatter(
            x=list(at), y=list(mean), mode="lines+markers", marker={"size": 4}, line={"color": colour}, name=name
        ),
        **where,
    )


def dots(figure: go.Figure, x: Numbers, y: Numbers, colour: str, texts: Sequence[str], **where: int) -> None:
    """Draw data sets as faint dots."""
    figure.add_trace(
        go.Scatter(
            x=list(x), y=list(y), mode="markers", marker={"size": 4, "color": translucent(colour, 0.45)},
            text=list(texts), hovertemplate="%{text}<br>%{x:.5g}, %{y:.3g} deg/s<extra></extra>", name="data sets",
        ),
        **where,
    )  # fmt: skip
