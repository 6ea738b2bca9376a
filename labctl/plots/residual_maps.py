"""Residual over floor in rate x temperature, a panel for each axis and position, one colour scale for all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import Any

import plotly.graph_objects as go

from labctl.plots.theme import DIMMED_BELOW, SCALE, SCALE_LIMITS, grid_of, place

#: Temperatures nearer than this are one row of a map; wider rows where there would be more than MOST_ROWS.
SAME_TEMPERATURE_K = 1.0
MOST_ROWS = 30
MOST_COLUMNS = 60
DIM = "rgba(128,128,128,0.5)"


def maps(answer: Mapping[str, Any]) -> go.Figure | None:
    """Return the maps; None without any."""
    drawn = [picture for picture in answer.get("maps", ()) if picture["over_floor"]]
    if not drawn:
        return None
    columns = min(len({picture["axis"] for picture in drawn}), 3)
    drawn.sort(key=lambda picture: (picture["position"], picture["axis"]))
    figure = grid_of([f"{p['axis']}, {p['position']} up" for p in drawn], columns, horizontal_spacing=0.08)
    for panel, picture in enumerate(drawn):
        _panel(figure, picture, place(panel, columns))
    largest = max(abs(score) for picture in drawn for score in picture["over_floor"])
    limit = min(max(largest, SCALE_LIMITS[0]), SCALE_LIMITS[1])
    figure.update_layout(
        coloraxis={
            "colorscale": SCALE, "cmin": -limit, "cmax": limit, "colorbar": {"title": "over<br>floor"},
        }
    )  # fmt: skip
    figure.update_xaxes(type="category")
    figure.update_yaxes(type="category")
    figure.update_xaxes(title="table rate, deg/s", row=-(-len(drawn) // columns))
    figure.update_yaxes(title="deg C", col=1)
    return figure


def _panel(figure: go.Figure, picture: Mapping[str, Any], where: Mapping[str, int]) -> None:
    columns, across = _bins(picture["table_rate_dps"], 0.0, MOST_COLUMNS)
    rows, down = _bins(picture["temperature_c"], SAME_TEMPERATURE_K, MOST_ROWS)
    cells: dict[tuple[int, int], list[int]] = {}
    for k, cell in enumerate(zip(down, across, strict=True)):
        cells.setdefault(cell, []).append(k)
    mean = [
        [_mean(picture["over_floor"], cells.get((r, c), [])) for c in range(len(columns))] for r in range(len(rows))
    ]
    sets = [
        [", ".join(str(picture["dataset"][k]) for k in cells.get((r, c), [])) for c in range(len(columns))]
        for r in range(len(rows))
    ]
    counts = [[len(cells.get((r, c), [])) for c in range(len(columns))] for r in range(len(rows))]
    dim = [
        [1 if v is not None and abs(v) * sqrt(n) < DIMMED_BELOW else None for v, n in zip(line, number, strict=True)]
        for line, number in zip(mean, counts, strict=True)
    ]
    x, y = _labels(columns), _labels(rows)
    figure.add_trace(
        go.Heatmap(
            x=x, y=y, z=mean, customdata=sets, coloraxis="coloraxis", xgap=1, ygap=1, name=picture["axis"],
            hovertemplate="%{x} deg/s, %{y} deg C: %{z:.2f} floors<br>data set %{customdata}<extra></extra>",
        ),
        **where,
    )  # fmt: skip
    figure.add_trace(
        go.Heatmap(
            x=x, y=y, z=dim, colorscale=[[0, DIM], [1, DIM]], showscale=False, hoverinfo="skip", xgap=1, ygap=1,
            name="not significant",
        ),
        **where,
    )  # fmt: skip


def _labels(values: Sequence[float]) -> list[str]:
    """Return values as short texts that all differ."""
    digits = next(d for d in range(3, 18) if d == 17 or len({f"{v:.{d}g}" for v in values}) == len(values))
    return [f"{value:.{digits}g}" for value in values]


def _mean(values: Sequence[float], rows: Sequence[int]) -> float | None:
    return sum(values[k] for k in rows) / len(rows) if rows else None


def _bins(values: Sequence[float], width: float, most: int) -> tuple[list[float], list[int]]:
    """Return the centres of the rising bins that values fall into, and which bin each value is in."""
    span = max(values) - min(values)
    width = max(width, 2e-3 * span)
    while True:
        order = sorted(range(len(values)), key=lambda k: values[k])
        which = [0] * len(values)
        groups: list[list[float]] = []
        for k in order:
            if not groups or values[k] - groups[-1][0] > width:
                groups.append([])
            groups[-1].append(values[k])
            which[k] = len(groups) - 1
        if len(groups) <= most:
            return [sum(group) / len(group) for group in groups], which
        width *= 1.5
