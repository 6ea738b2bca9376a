"""Answer of a reproduction: printed numbers beside reproduced ones."""

from __future__ import annotations

from labctl.answers.base import ResponseModel


class NumberResponse(ResponseModel):
    """A number of a paper; `reproduced` is null where it could not be made, and `why` says for what reason."""

    place: str
    quantity: str
    unit: str
    relation: str  #: "", "about" or "below": how the paper gives it
    printed: float | None
    of: str  #: what it was made from
    reproduced: float | None
    difference: float | None  #: reproduced less printed
    why: str
    origin: str = ""  #: measured, simulated, built in (the simulated unit was given it), computed; "": not made


class ContradictionResponse(ResponseModel):
    """Where the paper contradicts itself or leaves a choice."""

    place: str
    statement: str
    decision: str


class MissingResponse(ResponseModel):
    """A part that could not be made."""

    what: str
    why: str
    record: str  #: what to record so that it can be made


class FigureResponse(ResponseModel):
    """A figure on the page; `points` are those that it draws."""

    id: str
    title: str
    points: int


class ReproductionResponse(ResponseModel):
    """A paper made again."""

    paper: str
    title: str
    citation: str
    serial: str | None
    recording: int | None
    sources: list[str]
    story: list[str]
    numbers: list[NumberResponse]
    contradictions: list[ContradictionResponse]
    missing: list[MissingResponse]
    figures: list[FigureResponse]
    folder: str
    files: list[str]
