"""What is certainly or probably wrong with data, or with a fit to them."""

from __future__ import annotations

from typing import Literal

from typing_extensions import TypedDict

#: "certain": a fit of such data is wrong and is refused; "likely": it may be meant so, and is said.
Severity = Literal["certain", "likely"]


class FindingJson(TypedDict):
    """One thing that is wrong: what, where, its value, what was expected, what to do; `text`: all of it."""

    what: str
    severity: Severity
    where: str
    said: str
    value: float | None
    unit: str
    expected: str
    do: str
    text: str
