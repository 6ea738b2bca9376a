"""A version without refitting beside a recording: the model as lines over rate, and the error after a full turn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import plotly.graph_objects as go

from labctl.answers.comparison import ComparisonResponse
from labctl.plots.temperature_scale import temperature_colour, temperature_marker
from labctl.plots.theme import grid_of, place

T = TypeVar("T")
#: Far enough that the names of the axes are inside of the picture.
CAMERA = {"eye": {"x": 1.55, "y": 1.55, "z": 0.9}, "center": {"x": 0.0, "y": 0.0, "z": -0.18}}
#: The same box for every panel.
ASPECT = {"x": 1.0, "y": 1.0, "z": 0.8}


def error_over_rate(comparison: ComparisonResponse) -> go.Figure | None:
    """Return a panel for each output and position: measured errors as dots, a line for each temperature level."""
    columns = comparison.columns
    if not columns.dataset:
        return None
    axes, positions = _in_order(columns.axis), _in_order(columns.position)
    panels = [(axis, position) for axis in axes for position in positions]
    low, high = min(columns.temperature_c), max(columns.temperature_c)
    figure = grid_of([f"output {a}, turning about {p}" for a, p in panels], len(positions), horizontal_spacing=0.09)
    pairs = list(zip(columns.axis, columns.position, strict=True))
    lines = {(line.axis, line.position): line for line in comparison.over_rate}
    for panel, (axis, position) in enumerate(panels):
        where, line = place(panel, len(positions)), lines[axis, position]
        for level, error in zip(line.level, line.error_dps, strict=True):
            shade = {"color": temperature_colour(level, low, high), "width": 1.5}
            figure.add_trace(
                go.Scatter(x=line.at, y=error, mode="lines", line=shade, name=f"{level:.3g} deg C"), **where
            )
        rows = [k for k, pair in enumerate(pairs) if pair == (axis, position)]
        figure.add_trace(
            go.Scatter(
                x=_of(columns.table_rate_dps, rows), y=_of(columns.measured_error_dps, rows), mode="markers",
                name=f"{axis} about {position}", customdata=_of(columns.dataset, rows),
                marker=temperature_marker(_of(columns.temperature_c, rows), low, high, size=4),
                hovertemplate="data set %{customdata}<br>%{x:.5g} deg/s: %{y:.4g} deg/s<extra></extra>",
            ),
            **where,
        )  # fmt: skip
    figure.update_xaxes(title="table rate, deg/s", row=len(axes))
    figure.update_yaxes(title="error, deg/s", col=1)
    return figure


def full_turn(comparison: ComparisonResponse) -> go.Figure | None:
    """Return the error after a full turn over rate and temperature, before and after; None where nothing turns."""
    columns = comparison.columns
    rows = [k for k, error in enumerate(columns.turn_before_deg) if error is not None]
    if not rows:
        return None
    axes = _in_order(_of(columns.axis, rows))
    words = ("only static bias subtracted", "after the calibration")
    figure = grid_of(
        [f"{axis}: {word}" for axis in axes for word in words], 2, specs=[[{"type": "scene"}] * 2 for _ in axes]
    )
    low, high = min(columns.temperature_c), max(columns.temperature_c)
    for row, axis in enumerate(axes, 1):
        axis_rows = [k for k in rows if columns.axis[k] == axis]
        errors = {
            "turn_before_deg": _known(_of(columns.turn_before_deg, axis_rows)),
            "turn_after_deg": _known(_of(columns.turn_after_deg, axis_rows)),
        }
        least, most = (end(value for values in errors.values() for value in values) for end in (min, max))
        for col, (name, values) in enumerate(errors.items(), 1):
            marker = temperature_marker(_of(columns.temperature_c, axis_rows), low, high, size=3)
            figure.add_trace(
                go.Scatter3d(
                    x=_of(columns.own_rate_dps, axis_rows), y=_of(columns.temperature_c, axis_rows), z=values,
                    mode="markers", name=f"{axis} {name}", customdata=_of(columns.dataset, axis_rows), marker=marker,
                    hovertemplate="data set %{customdata}<br>%{x:.4g} deg/s, %{y:.3g} deg C: %{z:.3g} deg",
                ),
                row=row, col=col,
            )  # fmt: skip
            figure.update_scenes(
                xaxis_title="rate, deg/s", yaxis_title="deg C", zaxis_title="deg per turn",
                zaxis_range=[least, most], camera=CAMERA, aspectmode="manual", aspectratio=ASPECT, row=row, col=col,
            )  # fmt: skip
    figure.update_layout(height=420 * len(axes))
    return figure


def _in_order(names: Sequence[str]) -> list[str]:
    return sorted(set(names))


def _of(column: Sequence[T], rows: Sequence[int]) -> list[T]:
    return [column[k] for k in rows]


def _known(column: Sequence[float | None]) -> list[float]:
    return [value for value in column if value is not None]
