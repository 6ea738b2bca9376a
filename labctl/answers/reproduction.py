"""Figures of a paper as numbers: what the page of a reproduction draws."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict

from labctl.answers.views import Numbers


class PaperTrace(TypedDict):
    """Points, a line, or cells of a modelled map."""

    name: str
    """Name in the legend."""
    kind: Literal["points", "line", "dashes", "cells"]
    """How it is drawn."""
    x: Numbers
    """Horizontal coordinates, in the unit of the panel; null: a gap."""
    y: Numbers
    """Vertical coordinates, in the unit of the panel; null: a gap."""
    colour: NotRequired[list[float]]
    """A number for each point, on the colour scale of the panel; absent: one colour."""


class PaperPanel(TypedDict):
    """One pair of axes."""

    title: str
    """Title of the panel."""
    x_title: str
    """Title of the horizontal axis, with the unit."""
    y_title: str
    """Title of the vertical axis, with the unit."""
    colour_title: str
    """What the colours mean, with the unit; empty: no colours."""
    scale: Literal["temperature", "error"]
    """Colour scale."""
    traces: list[PaperTrace]
    """What is drawn."""


class PaperFigure(TypedDict):
    """A figure of a paper, reproduced."""

    id: str
    """Id of the figure on the page."""
    title: str
    """Title of the figure."""
    caption: str
    """Caption of the figure."""
    columns: int
    """Number of panels side by side, at least 1."""
    panels: list[PaperPanel]
    """The panels, row by row."""


class PaperNumber(TypedDict):
    """A printed number beside a reproduced one."""

    place: str
    """Where the paper prints it, such as Table 3."""
    quantity: str
    """Quantity of the number."""
    unit: str
    """Unit of the numbers; empty: none."""
    relation: str
    """How the paper qualifies the number, about or below; empty: it does not."""
    printed: float | None
    """The printed number, in `unit`; null: the paper prints a figure or a word."""
    of: str
    """Data that it was reproduced from."""
    reproduced: float | None
    """The reproduced number, in `unit`; null: see `why`."""
    difference: float | None
    """Reproduced minus printed number, in `unit`; null: one of them is missing."""
    why: str
    """Why the numbers differ, or why there is none."""
    origin: str
    """measured, simulated, built in or computed; empty: there is no number."""


class PaperPage(TypedDict):
    """The content of the page of a reproduction."""

    title: str
    """Title of the paper."""
    citation: str
    """Citation of the paper."""
    sources: list[str]
    """Data that it was reproduced from."""
    story: list[str]
    """What was done, in paragraphs."""
    numbers: list[PaperNumber]
    """Printed and reproduced numbers."""
    contradictions: list[tuple[str, str, str]]
    """Contradictions in the paper: place, statement, decision."""
    missing: list[tuple[str, str, str]]
    """What could not be reproduced: what, reason, what to record."""
    figures: list[PaperFigure]
    """The reproduced figures."""
