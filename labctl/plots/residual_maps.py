"""Residual over floor in rate x temperature: every measured cell, a panel for each axis and position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import sqrt
from typing import TypeVar

import plotly.graph_objects as go

from labctl.answers.criticism import CriticismResponse, ResidualMap
from labctl.plots.theme import DIMMED_BELOW, SCALE, SCALE_LIMITS, grid_of, place

T = TypeVar("T")
#: Cells that fill less than this share of their rows and columns are drawn where they are, not in a grid.
MIN_FILLED = 0.3
HOVER = "%{x} deg/s, %{y} deg C: %{z:.2f} floors<br>data set %{customdata}<extra></extra>"
DIM = "rgba(128,128,128,0.5)"


def maps(answer: CriticismResponse) -> go.Figure | None:
    """Return the maps; None without any."""
    drawn = [picture for picture in answer.maps if picture["over_floor"]]
    if not drawn:
        return None
    columns = min(len({picture["axis"] for picture in drawn}), 3)
    drawn.sort(key=lambda picture: (picture["position"], picture["axis"]))
    titles = [f"{p['axis']}, {p['position']} up: {cells_text(p)}" for p in drawn]
    figure = grid_of(titles, columns, horizontal_spacing=0.08)
    for panel, picture in enumerate(drawn):
        _panel(figure, picture, place(panel, columns))
    largest = max(abs(score) for picture in drawn for score in picture["over_floor"])
    limit = min(max(largest, SCALE_LIMITS[0]), SCALE_LIMITS[1])
    figure.update_layout(
        coloraxis={
            "colorscale": SCALE, "cmin": -limit, "cmax": limit, "colorbar": {"title": "over<br>floor"},
        }
    )  # fmt: skip
    figure.update_xaxes(title="table rate, deg/s", row=-(-len(drawn) // columns))
    widest = max(picture["level_width_c"] for picture in drawn)
    figure.update_yaxes(title=f"deg C (a row: within {widest:.2g})" if widest else "deg C", col=1)
    return figure


def _panel(figure: go.Figure, picture: ResidualMap, placement: Mapping[str, int]) -> None:
    columns, rows = (sorted(set(levels)) for levels in (picture["rate_level_dps"], picture["temperature_level_c"]))
    cells: dict[tuple[float, float], list[int]] = {}
    for k, cell in enumerate(zip(picture["temperature_level_c"], picture["rate_level_dps"], strict=True)):
        cells.setdefault(cell, []).append(k)
    mean = {cell: sum(picture["over_floor"][k] for k in sets) / len(sets) for cell, sets in cells.items()}
    named = {cell: ", ".join(str(picture["dataset"][k]) for k in sets) for cell, sets in cells.items()}
    dim = {cell: 1 for cell, sets in cells.items() if abs(mean[cell]) * sqrt(len(sets)) < DIMMED_BELOW}
    if len(cells) < MIN_FILLED * len(columns) * len(rows):
        _scattered(figure, cells, mean, named, dim, placement)
        return

    def grid(values: Mapping[tuple[float, float], T]) -> list[list[T | None]]:
        return [[values.get((row, column)) for column in columns] for row in rows]

    x, y = _labels(columns), _labels(rows)
    figure.add_trace(
        go.Heatmap(
            x=x, y=y, z=grid(mean), customdata=grid(named), coloraxis="coloraxis", xgap=1, ygap=1,
            name=picture["axis"], hovertemplate=HOVER, hoverongaps=False,
        ),
        **placement,
    )  # fmt: skip
    figure.add_trace(
        go.Heatmap(
            x=x, y=y, z=grid(dim), colorscale=[[0, DIM], [1, DIM]], showscale=False, hoverinfo="skip", xgap=1, ygap=1,
            name="not significant",
        ),
        **placement,
    )  # fmt: skip
    figure.update_xaxes(type="category", **placement)
    figure.update_yaxes(type="category", **placement)


def _scattered(
    figure: go.Figure, cells: Mapping[tuple[float, float], list[int]], mean: Mapping[tuple[float, float], float],
    label_by_place: Mapping[tuple[float, float], str], dim: Mapping[tuple[float, float], int],
    placement: Mapping[str, int],
) -> None:  # fmt: skip
    """Draw cells that share few rates or temperatures as squares at their own rate and temperature."""
    figure.add_trace(
        go.Scatter(
            x=[rate for _, rate in cells], y=[temperature_c for temperature_c, _ in cells], mode="markers",
            name="cells",
            customdata=list(label_by_place.values()), hovertemplate=HOVER.replace("%{z", "%{marker.color"),
            marker={
                "symbol": "square", "size": 8, "color": list(mean.values()), "coloraxis": "coloraxis",
                "opacity": [0.35 if cell in dim else 1.0 for cell in cells],
            },
        ),
        **placement,
    )  # fmt: skip


def cells_text(picture: ResidualMap) -> str:
    """Return how many data sets a panel shows, and what shares a cell."""
    cells = len(set(zip(picture["rate_level_dps"], picture["temperature_level_c"], strict=True)))
    n = len(picture["dataset"])
    return f"{n} data sets" + (f" in {cells} cells" if cells < n else "")


def _labels(values: Sequence[float]) -> list[str]:
    """Return values as short texts that all differ."""
    digits = next(d for d in range(3, 18) if d == 17 or len({f"{v:.{d}g}" for v in values}) == len(values))
    return [f"{value:.{digits}g}" for value in values]
