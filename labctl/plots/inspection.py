"""The picture of an inspection: every channel over time, with the places of what was found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise
from operator import itemgetter

import plotly.graph_objects as go

from labctl.answers.inspection import CourseJson, MarkJson
from labctl.plots.page import figure_part, whole_page
from labctl.plots.registry import Picture
from labctl.plots.theme import ACCENT, WARM, colour_of, grid_of, place, translucent
from labctl.texts import counted

#: A panel with a heading of one line, the part of it without readings, and a further line of its heading.
ROW_PX, GAP_PX, LINE_PX = 170, 45, 17
#: Left of the panels, where their headings begin too: on a phone there is no room for one in the middle.
LEFT_PX = 60
#: A dot where stretches of readings take less than this share of the time.
MARKER_PX, SPARSE = 4, 0.3
#: Units of the axis of time: name, seconds, and the shortest span that is drawn in it, s.
TIME_UNITS = (("h", 3600.0, 10_800.0), ("min", 60.0, 600.0), ("s", 1.0, 0.0))
#: Colours of the kinds of findings, in the order in which they appear.
COLOURS = ("#b3242f", WARM, ACCENT, "#7b5ea7", "#3a9d6e", "#a88b1f")
TITLE = "All readings, and where something was found"
CAPTION = (
    "Each channel over time. A line from the least to the largest reading of each bin: every reading lies within it, "
    "so no single reading is hidden. A coloured band marks the place of a finding; the heading of a channel says which "
    "findings it has, and how many of their places are drawn. A finding about whole rows is drawn in every channel."
)


def inspection_picture(courses: Sequence[CourseJson], marks: Sequence[MarkJson]) -> Picture | None:
    """Return the picture of an inspection; None without readings."""
    if not courses:
        return None
    kinds = list(dict.fromkeys(mark["what"] for mark in marks))
    colours = {kind: COLOURS[k % len(COLOURS)] for k, kind in enumerate(kinds)}
    headings = [_heading(course, _marks_of(course, marks)) for course in courses]
    further_px = LINE_PX * max(heading.count("<br>") for heading in headings)
    figure = grid_of(headings, 1, row_px=ROW_PX + further_px, gap_px=GAP_PX + further_px, shared_xaxes=True)
    figure.update_layout(margin={"t": 30 + LINE_PX * headings[0].count("<br>"), "l": LEFT_PX})
    figure.update_annotations(x=0.0, xanchor="left", xshift=8 - LEFT_PX, yshift=4, align="left", font={"size": 12})
    time_unit, unit_s = _time_unit(courses)
    bands: list[dict[str, object]] = []
    for panel, course in enumerate(courses):
        placement = place(panel, 1)
        figure.add_trace(_envelope(course, unit_s), **placement)
        if _is_sparse(course["t_s"]):
            figure.add_trace(_dots(course, unit_s), **placement)
        figure.update_yaxes(title=course["unit"], **placement)
        bands += [
            band for mark in _marks_of(course, marks) for band in _bands(mark, colours[mark["what"]], panel, unit_s)
        ]
    figure.update_layout(shapes=bands)  # all at once: plotly copies its figure for each that is added by itself
    figure.update_xaxes(title=f"time, {time_unit}", row=len(courses), col=1)
    return Picture("inspection", TITLE, CAPTION, figure)


def inspection_html(
    source: str, sentences: Sequence[str], courses: Sequence[CourseJson], marks: Sequence[MarkJson]
) -> str:
    """Return an HTML document of an inspection: its sentences, and the picture."""
    picture = inspection_picture(courses, marks)
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences) or "<li>nothing was found</li>"
    parts = [f"<h1>Inspection of {escape(source)}</h1>", f"<ul>{items}</ul>"]
    if picture is not None:
        parts.append(figure_part(picture))
    return whole_page(f"Inspection of {source}", parts, drawn=picture is not None)


def _marks_of(course: CourseJson, marks: Sequence[MarkJson]) -> list[MarkJson]:
    return [mark for mark in marks if mark["channel"] in ("", course["channel"])]


def _bands(mark: MarkJson, colour: str, panel: int, unit_s: float) -> list[dict[str, object]]:
    """Return the coloured bands of a finding in the panel of a channel, from 0, as plotly's shapes."""
    number = str(panel + 1) if panel else ""
    return [
        {
            "type": "rect", "xref": f"x{number}", "yref": f"y{number} domain", "x0": begin / unit_s,
            "x1": end / unit_s, "y0": 0, "y1": 1,
            "fillcolor": translucent(colour), "layer": "below", "line": {"color": colour, "width": 1},
        }
        for begin, end in zip(mark["from_s"], mark["until_s"], strict=True)
    ]  # fmt: skip


def _time_unit(courses: Sequence[CourseJson]) -> tuple[str, float]:
    """Return the unit of the axis of time, and its seconds: hours from 3 h on, minutes from 10 min on, else seconds."""
    times_s = [t_s for course in courses for t_s in course["t_s"] if t_s is not None]
    span_s = max(times_s, default=0.0) - min(times_s, default=0.0)
    return next(time_unit for time_unit in TIME_UNITS if span_s >= time_unit[2])[:2]


def _heading(course: CourseJson, marks: Sequence[MarkJson]) -> str:
    drawn = "each drawn" if course["bins"] >= course["readings"] else f"in {course['bins']:,} bins"
    lines = [f"<b>{course['channel']}</b>: {course['readings']:,} readings, {drawn}"]
    for mark in marks:
        if mark["whole"]:
            lines.append(f"{mark['what']} (all of it)")
        elif len(mark["from_s"]) < mark["places"]:
            lines.append(f"{mark['what']} ({len(mark['from_s'])} of {mark['places']} places drawn)")
        else:
            lines.append(f"{mark['what']} ({counted(mark['places'], 'place')})")
    return "<br>".join(lines)


def _envelope(course: CourseJson, unit_s: float) -> go.Scatter:
    x: list[float | None] = []
    y: list[float | None] = []
    for t_s, low, high in zip(course["t_s"], course["low"], course["high"], strict=True):
        at = None if t_s is None else t_s / unit_s
        x += [at] if low == high else [at, at]
        y += [low] if low == high else [low, high]
    return go.Scatter(
        x=x, y=y, mode="lines", line={"color": _colour(course), "width": 1}, name=course["channel"], connectgaps=False
    )


def _dots(course: CourseJson, unit_s: float) -> go.Scatter:
    """Return a dot at the least reading of each stretch, whose line is too short to be seen, and at the largest one.

    A largest reading within the dot of the least one has none. A browser takes 0.1 ms for each dot.
    """
    lows = [low for low in course["low"] if low is not None]
    highs = [high for high in course["high"] if high is not None]
    dot = (max(highs) - min(lows)) * MARKER_PX / ROW_PX
    x: list[float] = []
    y: list[float] = []
    for stretch in _stretches(course):
        at, low, _ = min(stretch, key=itemgetter(1))
        high_at, _, high = max(stretch, key=itemgetter(2))
        x += [at / unit_s] if high - low < dot else [at / unit_s, high_at / unit_s]
        y += [low] if high - low < dot else [low, high]
    return go.Scatter(
        x=x, y=y, mode="markers", marker={"size": MARKER_PX, "color": _colour(course)},
        name=f"{course['channel']}: dots", hoverinfo="skip",
    )  # fmt: skip


def _stretches(course: CourseJson) -> Iterator[list[tuple[float, float, float]]]:
    """Yield time, s, least and largest reading of the bins of each stretch."""
    stretch: list[tuple[float, float, float]] = []
    for at, low, high in zip(course["t_s"], course["low"], course["high"], strict=True):
        if at is not None and low is not None and high is not None:
            stretch.append((at, low, high))
        elif stretch:
            yield stretch
            stretch = []
    if stretch:
        yield stretch


def _colour(course: CourseJson) -> str:
    return colour_of(course["channel"].removeprefix("gyro_").removeprefix("accel_")[:1])


def _is_sparse(t_s: Sequence[float | None]) -> bool:
    """Return whether the readings, with None between two stretches, take so little of the time that lines are dots."""
    known_s = [at for at in t_s if at is not None]
    if len(known_s) < 2 or len(known_s) == len(t_s):
        return False
    within_s = sum(after - at for at, after in pairwise(t_s) if at is not None and after is not None)
    return within_s < SPARSE * (max(known_s) - min(known_s))
