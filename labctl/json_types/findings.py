"""What is certainly or probably wrong with data, or with a fit to them."""

from __future__ import annotations

from typing import Literal, NotRequired

from typing_extensions import TypedDict

#: "certain": a fit of such data is wrong and is refused; "likely": it may be meant so, and is said.
Severity = Literal["certain", "likely"]

#: The part of a recording: what a fit takes in, or what was measured to verify a calibration.
Part = Literal["fitted", "verification"]


class FindingJson(TypedDict):
    """One thing that is wrong: what, where, its value, what was expected, what to do; `text`: all of it.

    A finding that was kept before `part` was added concerns the whole recording. Of single readings `channel` names
    the column, `n` is how many they are, and `may_leave_out` says whether the rest can be used without them.
    """

    what: str
    severity: Severity
    where: str
    said: str
    value: float | None
    unit: str
    expected: str
    do: str
    text: str
    part: NotRequired[Part]
    channel: NotRequired[str]
    n: NotRequired[int]
    may_leave_out: NotRequired[bool]
