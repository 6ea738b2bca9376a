"""Lines of a budget from the time of a reference rate that changes, as the recording states it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.models.error_part import ErrorPart
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.budget import BudgetLine
from labctl.fitting.uncertainty.conditions import BenchConditions
from labctl.fitting.uncertainty.sensitivity import CoefficientFunction
from labctl.fitting.uncertainty.standard_lines import SourceLines


@dataclass(frozen=True)
class _Kind:
    """How errors of a source are distributed, and what is said of them."""

    name: str
    distribution: str
    is_common: bool
    why: str


#: Source of a part of the covariance -> what it is. An angle is taken at the request or at the reply rather
#: than half way between (`reply_time_u_s` of the instruments). The scatter of the angles has the stated uncertainty of
#: an encoder as its floor, so that its degrees of freedom are taken as infinite.
KINDS = {
    "table_time_common": _Kind(
        "time of the reference rate, all data sets", "u-shaped", is_common=True,
        why="the time of the reference rate that all data sets have in common: whether an angle was taken at the "
        "request or at the reply is not known, and a delay is known no better than that",
    ),
    "table_time": _Kind(
        "time of the reference rate, each data set", "normal", is_common=False,
        why="the time of the reference rate in each data set, by the scatter of the angles of the table",
    ),
}  # fmt: skip
TIME = "table_time_common"
NOT_STATED = (
    "the recording does not state it, so its contribution is not in U; a delay is off by all of it. Add the columns "
    "table_time_u_s and table_time_common_u_s, or measure again"
)


def time_lines(
    fitted: FittedModel,
    laws: Sequence[CoefficientFunction],
    temperature_c: float,
    bench: BenchConditions | None,
    gain: NDArray[np.float64] | None = None,
) -> list[SourceLines]:
    """Return the lines of n results, each a function of the coefficients of an output axis.

    `gain` (n, n) is how the functions add to the results; without it each is one. A profile of which nothing states the
    time has a line of unknown size; a rate that is constant has none.
    """
    n = len(laws)
    gain = np.eye(n) if gain is None else gain
    source_lines = []
    for source in KINDS:
        parts = [_part(fitted, law.axis, source) for law in laws]
        if (part_stated := next((part for part in parts if part is not None), None)) is None:
            continue
        changes = np.array([
            np.zeros(part_stated.root.shape[1]) if part is None else law.gradient(fitted, temperature_c) @ part.root
            for part, law in zip(parts, laws, strict=True)
        ])  # fmt: skip
        source_lines.append(_lines(part_stated, np.asarray(gain @ changes)))
    if source_lines or bench is None or bench.motion != "profile":
        return source_lines
    line = BudgetLine(TIME, TIME, "B", "", None, "s", None, None, is_common=True, is_stated=False, why=NOT_STATED)
    return [SourceLines((line,) * n, np.zeros((n, n)))]


def _part(fitted: FittedModel, axis: str, source: str) -> ErrorPart | None:
    return next((part for part in fitted.axes[axis].parts if part.source == source), None)


def _lines(part: ErrorPart, changes: Array) -> SourceLines:
    """Return the lines of results that change by (n, j) with one standard uncertainty of each error."""
    kind, covariance = KINDS[part.source], changes @ changes.T
    lines = tuple(
        BudgetLine(
            part.source, kind.name, "B", kind.distribution, part.u, part.unit,
            float(size) / part.u if part.u else None, float(size), is_common=kind.is_common, why=kind.why,
        )
        for size in np.sqrt(np.diag(covariance))
    )  # fmt: skip
    return SourceLines(lines, covariance)
