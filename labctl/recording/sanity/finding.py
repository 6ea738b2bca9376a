"""A finding: one thing in a recording that is wrong, or probably wrong, before anything is fitted to it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labctl.answers.inspection import Part, Severity


@dataclass(frozen=True)
class Finding:
    """What was found, where, its value, what was expected, and what to do."""

    what: str  #: a word for programs: "sign", "unit", "scale", ...
    severity: Severity
    where: str  #: axis, position, data set or column
    said: str  #: what is the case, in words, with value and unit
    value: float | None
    unit: str
    expected: str
    do: str
    part: Part = "fitted"  #: of the recording: what a fit takes in, or what was measured to verify a calibration
    channel: str = ""  #: the column that it is about; empty: the recording, or data sets
    n: int | None = None  #: readings that it is about; None: it is not about single readings
    may_leave_out: bool = False  #: whether those readings can be left out, and the rest be used

    @property
    def text(self) -> str:
        """One sentence: where, what, and what to do."""
        return f"{self.where}: {self.said} (expected {self.expected}); {self.do}"


def certain(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings with which a fit is certainly wrong."""
    return [finding for finding in findings if finding.severity == "certain"]


def numbers_in_words(numbers: Iterable[int], most: int = 6) -> str:
    """Return "data set 7" or "data sets 1, 2, 3 and 40 more" for the numbers of data sets."""
    whole_numbers = [int(number) for number in numbers]
    listed = ", ".join(str(number) for number in whole_numbers[:most])
    more = f" and {len(whole_numbers) - most} more" if len(whole_numbers) > most else ""
    return f"data set{'s' if len(whole_numbers) > 1 else ''} {listed}{more}"
