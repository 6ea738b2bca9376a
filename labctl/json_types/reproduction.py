"""Figures of a paper as numbers: what the page of a reproduction draws."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict

from labctl.json_types.views import Numbers


class PaperTrace(TypedDict):
    """Points, a line, or cells of a modelled map; `colour` is a number for each, on the colour scale of its panel."""

    name: str
    kind: Literal["points", "line", "dashes", "cells"]
    x: Numbers
    y: Numbers
    colour: NotRequired[list[float]]


class PaperPanel(TypedDict):
    """One pair of axes, each labelled with its unit."""

    title: str
    x_title: str
    y_title: str
    colour_title: str  #: what the colours mean, with the unit; "" without colours
    scale: Literal["temperature", "error"]
    traces: list[PaperTrace]


class PaperFigure(TypedDict):
    """A figure of a paper, made again; `columns` is how many panels stand side by side."""

    id: str
    title: str
    caption: str
    columns: int
    panels: list[PaperPanel]


class PaperNumber(TypedDict):
    """A printed number beside a reproduced one."""

    place: str
    quantity: str
    unit: str
    relation: str
    printed: float | None
    of: str
    reproduced: float | None
    difference: float | None
    why: str
    origin: str  #: measured, simulated, built in or computed


class PaperPage(TypedDict):
    """What the page of a reproduction says."""

    title: str
    citation: str
    sources: list[str]
    story: list[str]
    numbers: list[PaperNumber]
    contradictions: list[tuple[str, str, str]]  #: place, statement, decision
    missing: list[tuple[str, str, str]]  #: what, reason, what to record
    figures: list[PaperFigure]
