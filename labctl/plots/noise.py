"""Noise and error: the Allan deviation of a static record, points measured again, the ladder of versions."""

from __future__ import annotations

import plotly.graph_objects as go

from labctl.answers.criticism import CriticismResponse
from labctl.answers.ladder import LadderResponse
from labctl.answers.noise import AllanJson
from labctl.answers.views import Numbers, Repeats
from labctl.plots.theme import ACCENT, INK, WARM, colour_of, grid_of, place


def allan(answer: CriticismResponse) -> go.Figure | None:
    """Return the Allan deviation with its 95 % interval and the fitted terms; None without a static record."""
    static = answer.noise["static"]
    if not static:
        return None
    axes = static["axes"]
    figure = grid_of([_figures_text(axis, line) for axis, line in axes.items()], min(len(axes), 3))
    for panel, (axis, line) in enumerate(axes.items()):
        placement, colour = place(panel, min(len(axes), 3)), colour_of(axis)
        sigma = line["deviation_dps"]
        figure.add_trace(
            go.Scatter(
                x=line["tau_s"], y=sigma, mode="markers", marker={"color": colour}, name=axis,
                error_y={
                    "type": "data", "symmetric": False, "color": colour,
                    "array": _apart(line["high_dps"], sigma),
                    "arrayminus": _apart(sigma, line["low_dps"]),
                },
            ),
            **placement,
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=line["tau_s"], y=line["model_dps"], mode="lines", line={"color": INK, "dash": "dash"}, name="terms"
            ),
            **placement,
        )
    figure.update_xaxes(type="log", title="averaging time, s")
    figure.update_yaxes(type="log", title="Allan deviation, deg/s", col=1)
    figure.update_yaxes(type="log")
    return figure


def _apart(high: Numbers, low: Numbers) -> Numbers:
    pairs = zip(high, low, strict=True)
    return [None if upper is None or lower is None else upper - lower for upper, lower in pairs]


def _figures_text(axis: str, line: AllanJson) -> str:
    parts = [
        f"{letter} = {figure['value']:.3g} {figure['unit']}"
        for letter, figure in (("N", line["N"]), ("B", line["B"]), ("K", line["K"]))
        if figure["value"] is not None
    ]
    return f"{axis}: {', '.join(parts) or 'no slope shows'}"


def repeats(answer: CriticismResponse) -> go.Figure | None:
    """Return the differences of points measured again against the time between; None where nothing was repeated."""
    views = answer.views
    lines = views.get("repeats") or []
    if not lines:
        return None
    figure = grid_of([_repeats_text(line) for line in lines], min(len(lines), 3))
    timed = all("apart_s" in line for line in lines)
    for panel, line in enumerate(lines):
        placement = place(panel, min(len(lines), 3))
        figure.add_trace(
            go.Scatter(
                x=_minutes(line.get("apart_s", [])) if timed else line["apart_sets"],
                y=line["difference_dps"], mode="markers",
                marker={"color": colour_of(line["axis"]), "size": 5}, name=line["axis"],
                text=[f"data sets {a} and {b}" for a, b in line["datasets"]],
                hovertemplate="%{text}<br>%{y:.3g} deg/s<extra></extra>",
            ),
            **placement,
        )  # fmt: skip
        floor_dps = line["floor_dps"]
        levels = () if floor_dps is None else (-2 * 2**0.5 * floor_dps, 2 * 2**0.5 * floor_dps)
        for level in levels:
            figure.add_hline(y=level, line={"color": INK, "dash": "dash", "width": 1}, **placement)
    figure.update_xaxes(title="apart, min" if timed else "apart, data sets")
    figure.update_yaxes(title="difference, deg/s", col=1)
    return figure


def _minutes(seconds: Numbers) -> Numbers:
    return [None if value is None else value / 60 for value in seconds]


def _repeats_text(line: Repeats) -> str:
    n_shown = len(line["difference_dps"])
    drawn = f"; {n_shown} of {line['pairs']} pairs drawn" if n_shown < line["pairs"] else ""
    return f"{line['axis']}: {line['over_floor'] or 0.0:.2f} of the floor{drawn}"


def ladder(answer: LadderResponse) -> go.Figure | None:
    """Return the errors of every version down to the noise floor; None without any error."""
    steps = [step for step in answer.steps if step.rms_dps is not None]
    if not steps:
        return None
    figure = grid_of([""], 1)
    names = [f"{step.version}: {step.model}" for step in steps]
    fitted, unseen = [step.rms_dps for step in steps], [step.heldout_rms_dps for step in steps]
    for errors, word, colour in ((fitted, "on its own data", ACCENT), (unseen, "held out", WARM)):
        figure.add_trace(
            go.Scatter(
                x=names, y=errors, mode="lines+markers", line={"color": colour, "shape": "hv"},
                name=word, text=[", ".join(step.effects) for step in steps],
                hovertemplate="%{y:.4g} deg/s<br>%{text}<extra></extra>",
            )
        )  # fmt: skip
    floor = answer.noise_floor_dps
    if floor:
        line = {"color": INK, "dash": "dash"}
        figure.add_trace(
            go.Scatter(x=names, y=[floor] * len(names), mode="lines+markers", line=line, name="noise floor")
        )
    figure.update_layout(showlegend=True)
    figure.update_xaxes(type="category")
    figure.update_yaxes(type="log", title="RMS error, deg/s")
    return figure
