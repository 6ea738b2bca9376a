"""A point of a figure beside the same point computed from raw readings: one answer for every such figure."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.answers.points import FigureNumber, FigurePointResponse, RecomputedFigure

#: Rounding of a sum of doubles, as a share of what is added up.
ROUNDING = 1e-12


def figure_number(
    name: str, unit: str, shown: float | None, recomputed: float | None, *, rounding: float | None = None
) -> FigureNumber:
    """Return a number of a point; `rounding` in its unit, default: ROUNDING of the number, of 1 at least."""
    if rounding is None:
        rounding = ROUNDING * max(1.0, abs(shown or 0.0))
    return FigureNumber(name=name, unit=unit, shown=shown, recomputed=recomputed, rounding=rounding)


def figure_point(
    figure: RecomputedFigure, title: str, recording: int, datasets: tuple[int, int], numbers: Sequence[FigureNumber],
    formula: str, readings: NDArray[np.float64],
) -> FigurePointResponse:  # fmt: skip
    """Return the answer for a point that is made of `readings`, (n,) in the unit of the channel; none: (0,)."""
    differences = {
        each.name: (abs(each.recomputed - each.shown), each)
        for each in numbers
        if each.recomputed is not None and each.shown is not None
    }
    off = [
        f"{name} differs by {size:.2g} {each.unit}".rstrip()
        for name, (size, each) in differences.items()
        if not size <= each.rounding
    ]
    n = len(readings)
    if not n:
        summary = f"Recording {recording} has means of data sets and no readings, so nothing was computed again."
    elif off:
        summary = f"Recomputed from {n} raw readings: not equal, {', '.join(off)}."
    else:
        summary = f"Recomputed from {n} raw readings: equal."
    return FigurePointResponse(
        figure=figure, title=title, recording=recording, datasets=list(datasets), numbers=list(numbers),
        formula=formula, equal=not off if n else None, readings=n,
        readings_sha256=hashlib.sha256(readings.astype("<f8").tobytes()).hexdigest() if n else None, summary=summary,
    )  # fmt: skip
