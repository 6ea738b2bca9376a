"""What is certainly or probably wrong with data, or with a fit to them."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict

#: "certain": a fit of such data is wrong and is refused; "likely": it may be meant so, and is said.
Severity = Literal["certain", "likely"]

#: The part of a recording: what a fit takes in, or what was measured to verify a calibration.
Part = Literal["fitted", "verification"]


class FindingJson(TypedDict):
    """One thing that is wrong with data or with a fit."""

    what: str
    """Kind of error, as a fixed word for programs: sign, unit, scale, ..."""
    severity: Severity
    """certain: a fit is refused; likely: it is reported."""
    where: str
    """Axis, position, data sets or column that it concerns."""
    said: str
    """What is the case, in words, with value and unit."""
    value: float | None
    """Value that was found, in `unit`; null: there is no single number."""
    unit: str
    """Unit of the value; empty: it has none."""
    expected: str
    """What was expected, in words."""
    do: str
    """What to do."""
    text: str
    """All of it in one sentence."""
    part: NotRequired[Part]
    """Part of the recording that it concerns; absent: all of it, by an older version of labctl."""
    channel: NotRequired[str]
    """Column of the single readings that it concerns; empty: whole rows; absent: it is not about single readings."""
    n: NotRequired[int]
    """Number of single readings that it concerns, at least 1; absent: it is not about single readings."""
    may_leave_out: NotRequired[bool]
    """Whether the other readings can be used without these; absent: it is not about single readings."""
