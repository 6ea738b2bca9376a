"""Figures 1 and 3 to 9 of Ojeda et al. 2000."""

from __future__ import annotations

import numpy as np

from labctl.answers.reproduction import PaperFigure, PaperPanel, PaperTrace
from labctl.fitting import Channels
from labctl.fitting.data.levels import level_centres, rate_levels
from labctl.fitting.numeric.arrays import Array
from labctl.papers import ojeda2000 as paper
from labctl.services.reproduction.findings import Missing, panel, trace
from labctl.services.reproduction.ojeda_surface import Surface

RATE, WARM, ERROR, TURN = "table rate, deg/s", "temperature, deg C", "error, deg/s", "error per turn, deg"
#: A measured rate stands for one of Fig. 4 within this many deg/s.
NEAR_DPS = 6.0
#: Lines of a fitted surface, points along each, and cells of its map.
LINES, ALONG, CELLS = 5, 81, 21


def _slug(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower())


def at_rest(name: str, t_s: Array, rate_dps: Array) -> PaperFigure:
    """Return figure 1: the readings at rest."""
    return {
        "id": f"figure-1-{_slug(name)}", "title": f"Figure 1: output at rest, {name}", "columns": 1,
        "caption": f"{len(t_s)} readings of the first {paper.STATIC_S:g} s at rest, all drawn. The line is their mean, "
        "the static bias of eq. 1.",
        "panels": [panel("", "time, s", "output, deg/s", [
            trace("readings", t_s, rate_dps),
            trace("mean", t_s[[0, -1]], np.full(2, rate_dps.mean()), "dashes"),
        ])],
    }  # fmt: skip


def of_surface(surface: Surface) -> tuple[list[PaperFigure], list[Missing]]:
    """Return figures 3 to 9, and the parts of figure 4 that were not measured."""
    name, n = surface.name, len(surface.rate_dps)
    fourth, missing = _over_temperature(surface)
    turning = int(np.isfinite(surface.turn_before_deg).sum())
    note = f"{turning} of {n} data sets, those from 5 deg/s on; below, the error per turn grows without bound."
    traces = [
        _pair(surface, 3, "error against rate", surface.raw_dps, f"All {n} data sets: output less table rate.",
              one=True),
        *fourth,
        _pair(surface, 5, "measured error surface", surface.raw_dps,
              f"All {n} data sets, over rate and over rate and temperature."),
        _fitted(surface),
        _pair(surface, 7, "error after compensation", surface.left_dps,
              f"All {n} data sets, corrected output less table rate, on the data of the fit. The scale is its own."),
        _pair(surface, 8, "error per turn, static bias off only", surface.turn_before_deg,
              f"{note} The static bias is that of the data sets at rest, at each temperature.", y=TURN),
        _pair(surface, 9, "error per turn, full compensation", surface.turn_after_deg,
              f"{note} Surface and remaining static bias are taken off (eq. 16). The scale is its own.", y=TURN),
    ]  # fmt: skip
    for figure in traces:
        figure["title"] = f"{figure['title']}, {name}"
        figure["id"] = f"{figure['id']}-{_slug(name)}"
    return traces, missing


def _pair(
    surface: Surface, number: int, title: str, error: Array, caption: str, *, y: str = ERROR, one: bool = False
) -> PaperFigure:
    """Return an error over the rate, coloured by temperature, and over both, coloured by the error."""
    is_finite = np.isfinite(error)
    rate, temperature_c, values = surface.rate_dps[is_finite], surface.temperature_c[is_finite], error[is_finite]
    panels = [panel("", RATE, y, [trace("data sets", rate, values, colour=temperature_c)], "deg C")]
    if not one:
        panels.append(panel("", RATE, WARM, [trace("data sets", rate, temperature_c, colour=values)], y, "error"))
    return {
        "id": f"figure-{number}", "title": f"Figure {number}: {title}", "caption": caption, "columns": len(panels),
        "panels": panels,
    }  # fmt: skip


def _modelled(surface: Surface, output_dps: Array, temperature_c: Array) -> Array:
    """Return the fitted error (eq. 12), (n,) deg/s, at outputs and temperatures (n,); no other axis turns."""
    rates = {a: np.zeros(len(output_dps)) for a in surface.result.fitted.axes} | {surface.axis: output_dps}
    columns = {"temperature_c": temperature_c, f"temperature_{surface.axis}_c": temperature_c}
    return surface.result.fitted.error_dps(Channels(columns, rates), surface.axis)


def _fitted(surface: Surface) -> PaperFigure:
    outputs = np.linspace(surface.output_dps.min(), surface.output_dps.max(), ALONG)
    lines = [
        trace(f"{temperature_c:.1f} deg C", outputs, _modelled(surface, outputs, np.full(ALONG, temperature_c)), "line")
        for temperature_c in np.linspace(surface.temperature_c.min(), surface.temperature_c.max(), LINES)
    ]
    x, t = np.meshgrid(
        np.linspace(outputs[0], outputs[-1], CELLS),
        np.linspace(surface.temperature_c.min(), surface.temperature_c.max(), CELLS),
    )
    cells = _modelled(surface, x.ravel(), t.ravel())
    return {
        "id": "figure-6", "title": "Figure 6: fitted error surface", "columns": 2,
        "caption": f"Left: the fitted error at {LINES} temperatures over the measured range. Right: the same on a grid "
        f"of {CELLS} x {CELLS} points.",
        "panels": [
            panel("", "output, deg/s", ERROR, lines),
            panel("", "output, deg/s", WARM, [trace("model", x.ravel(), t.ravel(), "cells", cells)], ERROR, "error"),
        ],
    }  # fmt: skip


def _over_temperature(surface: Surface) -> tuple[list[PaperFigure], list[Missing]]:
    level = rate_levels(surface.rate_dps)
    centre = level_centres(surface.rate_dps, level)
    panels: list[PaperPanel] = []
    absent: list[str] = []
    for size in paper.FIGURE_4_RATES_DPS:
        traces: list[PaperTrace] = []
        sentences: list[str] = []
        for rate in (size, -size):
            nearest = float(centre[int(np.argmin(np.abs(centre - rate)))])
            if abs(nearest - rate) > NEAR_DPS:
                absent.append(f"{rate:+g}")
                continue
            at_rate, sign = centre == nearest, "+" if rate > 0 else "-"
            sentences.append(f"{nearest:+.1f}")
            temperature_c, output = surface.temperature_c[at_rate], float(surface.output_dps[at_rate].mean())
            grid = np.linspace(temperature_c.min(), temperature_c.max(), ALONG)
            traces += [
                trace(f"measured, {sign} deg/s", temperature_c, surface.raw_dps[at_rate]),
                trace(f"model, {sign} deg/s", grid, _modelled(surface, np.full(ALONG, output), grid), "line"),
            ]
        if traces:
            panels.append(panel(f"{' and '.join(sentences)} deg/s", WARM, ERROR, traces))
    drawn = sum(len(t["x"]) for p in panels for t in p["traces"] if t["kind"] == "points")
    missing = []
    if absent:
        missing.append(
            Missing(
                f"Figure 4 of {surface.name} at {', '.join(absent)} deg/s",
                f"no measured rate is within {NEAR_DPS:g} deg/s of it",
                "these rates at three temperatures or more",
            )
        )
    if not panels:
        return [], missing
    figure: PaperFigure = {
        "id": "figure-4", "title": "Figure 4: error against temperature", "columns": len(panels),
        "caption": f"{drawn} of {len(surface.rate_dps)} data sets, those nearest to the paper's rates, and the fitted "
        "surface at their mean output.",
        "panels": panels,
    }  # fmt: skip
    return [figure], missing
