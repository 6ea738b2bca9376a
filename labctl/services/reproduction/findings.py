"""What the reproduction of a paper has found, and the few ways to say it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from labctl.answers.reproduction import PaperFigure, PaperPanel, PaperTrace
from labctl.answers.views import Numbers

#: Where a number is from. measured: a real unit. simulated: what labctl makes of a simulated unit. built in: the
#: simulated unit was given it, so that its return shows the arithmetic only. computed: from printed numbers alone.
Origin = Literal["measured", "simulated", "built in", "computed", ""]
PRINTED = "printed numbers"


@dataclass(frozen=True)
class Value:
    """A reproduced number: of which printed one (`labctl.papers`), from what, and why it differs."""

    id: str
    of: str
    value: float | None
    why: str = ""
    origin: Origin = ""


@dataclass(frozen=True)
class Missing:
    """A part of a paper that a recording does not give."""

    what: str
    why: str
    record: str


@dataclass
class Findings:
    """Everything that a page says beside the paper's own facts."""

    sources: list[str] = field(default_factory=list)
    story: list[str] = field(default_factory=list)
    values: list[Value] = field(default_factory=list)
    missing: list[Missing] = field(default_factory=list)
    figures: list[PaperFigure] = field(default_factory=list)

    def told(self, origin: Origin, built_in: Callable[[str], bool] = lambda _: False) -> Findings:
        """Return these findings with the origin of each number; `built_in` names those that a simulation was given."""

        def of(value: Value) -> Origin:
            if value.origin or value.value is None:
                return value.origin
            if value.of == PRINTED:
                return "computed"
            return "built in" if origin == "simulated" and built_in(value.id) else origin

        return replace(self, values=[replace(value, origin=of(value)) for value in self.values])

    def add(self, other: Findings) -> None:
        """Take in what another recording gave."""
        self.sources += other.sources
        self.story += other.story
        self.values += other.values
        self.missing += other.missing
        self.figures += other.figures


def numbers(values: ArrayLike) -> Numbers:
    """Return numbers (n,) as JSON: None for NaN."""
    return [float(v) if np.isfinite(v) else None for v in np.asarray(values, dtype=np.float64)]


def trace(
    name: str, x: ArrayLike, y: ArrayLike, kind: Literal["points", "line", "dashes", "cells"] = "points",
    colour: ArrayLike | None = None,
) -> PaperTrace:  # fmt: skip
    """Return points or a line of (n,) numbers."""
    paper_trace: PaperTrace = {"name": name, "kind": kind, "x": numbers(x), "y": numbers(y)}
    if colour is not None:
        paper_trace["colour"] = np.asarray(colour, dtype=np.float64).tolist()
    return paper_trace


def panel(
    title: str, x_title: str, y_title: str, traces: Iterable[PaperTrace], colour_title: str = "",
    scale: Literal["temperature", "error"] = "temperature",
) -> PaperPanel:  # fmt: skip
    """Return a panel."""
    return {
        "title": title, "x_title": x_title, "y_title": y_title, "colour_title": colour_title, "scale": scale,
        "traces": list(traces),
    }  # fmt: skip


def points_in(figure: PaperFigure) -> int:
    """Return how many points a figure draws; lines are not counted."""
    return sum(len(t["x"]) for p in figure["panels"] for t in p["traces"] if t["kind"] == "points")
