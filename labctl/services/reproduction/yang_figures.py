"""Figures 4 to 9 of Yang et al. 2018."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.answers.reproduction import PaperFigure, PaperPanel, PaperTrace
from labctl.fitting import FitData, FittedModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.papers import yang2018 as paper
from labctl.services.reproduction.findings import panel, trace
from labctl.services.reproduction.yang_errors import Judged

RATE, WARM, ERROR = "table rate, deg/s", "temperature, deg C", "error, deg/s"
#: Points along an interpolated coefficient.
ALONG = 91


def coefficients(name: str, fitted: FittedModel) -> list[PaperFigure]:
    """Return figures 4 to 6: scale factors, misalignments and biases against temperature."""
    several = len(fitted.axes) > 1
    parts: list[tuple[int, str, str, Callable[[str], bool]]] = [
        (4, "scale factors", "K, 1", lambda coefficient: coefficient == "scale_factor"),
        (5, "misalignments", "K, 1", lambda coefficient: coefficient.startswith("misalignment_")),
        (6, "biases", "bias, deg/s", lambda coefficient: coefficient == "bias"),
    ]
    return [
        _against_temperature(name, fitted, number, title, y, wanted)
        for number, title, y, wanted in parts
        if several or number != 5
    ]


def _against_temperature(
    name: str, fitted: FittedModel, number: int, title: str, y: str, wanted: Callable[[str], bool]
) -> PaperFigure:
    table = fitted.model.temperature
    assert isinstance(table, LagrangeTable)
    grid = np.linspace(table.nodes_c[0], table.nodes_c[-1], ALONG)
    basis = table.basis(grid)
    panels = []
    for out, axis in fitted.axes.items():
        for coefficient, values in zip(axis.names, axis.values, strict=True):
            if wanted(coefficient):
                label, shift = _paper_name(coefficient, out), 1.0 if coefficient == "scale_factor" else 0.0
                traces = [
                    trace("at the measured temperatures", table.nodes_c, values + shift),
                    trace("interpolated", grid, basis @ values + shift, "line"),
                ]
                panels.append(panel(label, WARM, y, traces))
    return {
        "id": f"figure-{number}", "title": f"Figure {number}: {title} against temperature, {name}", "columns": 3,
        "caption": f"Dots are the coefficients at the {len(table.nodes_c)} measured temperatures, all drawn; lines are "
        "the three-point Lagrange interpolation. Kij multiplies the rate about i in output j.",
        "panels": panels,
    }  # fmt: skip


def _paper_name(coefficient: str, out: str) -> str:
    if coefficient == "bias":
        return f"B{out}"
    return f"K{out}{out}" if coefficient == "scale_factor" else f"K{coefficient[-1]}{out}"


def errors(judged: Judged, shown: tuple[NDArray[np.bool_], float]) -> list[PaperFigure]:
    """Return figures 7 to 9: nine panels each, turning about x, y, z in rows and outputs x, y, z in columns."""
    at_shown_level, at_c = shown
    data, n = judged.data, len(judged.data)
    methods = {"uncompensated": judged.raw, "traditional": judged.traditional, "proposed": judged.proposed}
    at_level = {name: {a: v[at_shown_level] for a, v in method.items()} for name, method in methods.items()}
    note = f"Rows: axis that is turned; columns: output. Errors after compensation: {judged.how}."
    level = f"The {int(at_shown_level.sum())} of {n} data sets at {at_c:.1f} deg C, the level nearest to 25."
    return [
        _surface(data, judged.raw, "7", "before compensation", f"All {n} data sets. {note}"),
        _surface(data, judged.proposed, "7", "after compensation, proposed", f"{_drawn(data, judged.proposed)} {note}"),
        _lines(data.take(at_shown_level), at_level, "8", "uncompensated, traditional, proposed", f"{level} {note}"),
        _lines(
            data.take(at_shown_level), {name: at_level[name] for name in ("traditional", "proposed")}, "9",
            "traditional and proposed, on their own scale", f"{level} {note}",
        ),
    ]  # fmt: skip


def _drawn(data: FitData, by_axis: Mapping[str, Array]) -> str:
    known = int(np.all([np.isfinite(values) for values in by_axis.values()], axis=0).sum())
    return f"{known} of {len(data)} data sets."


def _panels(data: FitData) -> list[tuple[str, str, NDArray[np.bool_]]]:
    """Return axis that is turned, output, and the data sets (m,) of each panel."""
    turning = np.char.lstrip(np.asarray(data.channels["position"]).astype(np.str_), "-")
    return [(axis, out, turning == axis) for axis in paper.AXES if axis in turning for out in data.outputs]


def _surface(data: FitData, by_axis: Mapping[str, Array], number: str, title: str, caption: str) -> PaperFigure:
    rate, temperatures_c = data.channels.table_rate_dps(), data.temperature_c
    panels: list[PaperPanel] = []
    for axis, out, rows in _panels(data):
        known = rows & np.isfinite(by_axis[out])
        traces = [trace("data sets", rate[known], by_axis[out][known], colour=temperatures_c[known])]
        panels.append(panel(f"turning {axis}, output {out}", RATE, ERROR, traces, "deg C"))
    return {
        "id": f"figure-{number}-{title.split(maxsplit=1)[0]}", "title": f"Figure {number}: error {title}",
        "caption": caption,
        "columns": len(data.outputs), "panels": panels,
    }  # fmt: skip


def _lines(
    data: FitData, methods: Mapping[str, Mapping[str, Array]], number: str, title: str, caption: str
) -> PaperFigure:
    rate = data.channels.table_rate_dps()
    panels: list[PaperPanel] = []
    for axis, out, rows in _panels(data):
        traces: list[PaperTrace] = []
        for name, by_axis in methods.items():
            known = rows & np.isfinite(by_axis[out])
            traces.append(trace(name, rate[known], by_axis[out][known]))
        panels.append(panel(f"turning {axis}, output {out}", RATE, ERROR, traces))
    return {
        "id": f"figure-{number}", "title": f"Figure {number}: {title}", "caption": caption,
        "columns": len(data.outputs), "panels": panels,
    }  # fmt: skip
