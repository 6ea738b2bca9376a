"""labctl's values and those of the independent analyses, side by side as rows of a table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from studies.real.answers import Answer, Commands
from studies.real.independent.files import Found, Value
from studies.real.recordings import RECORDINGS, Recording

#: Errors that differ by less than this share are the same.
SAME_ERROR = 0.05


@dataclass(frozen=True)
class Row:
    """One quantity by both. `difference` is in labctl's standard uncertainties; nan where none is stated."""

    quantity: str
    labctl: Value
    independent: Value

    @property
    def is_error(self) -> bool:
        """Whether the quantity is an error, where less is better and no uncertainty is stated."""
        return "error" in self.quantity or "off by" in self.quantity

    @property
    def difference(self) -> float:
        """labctl's value minus the other, in labctl's standard uncertainties."""
        return (self.labctl.value - self.independent.value) / self.labctl.u

    @property
    def agreement(self) -> str:
        """Return yes or no; of an error whether labctl's is better, the same or worse."""
        if not self.is_error:
            return "yes" if abs(self.difference) <= 2 else "no"
        ratio = self.labctl.value / self.independent.value
        if abs(ratio - 1) <= SAME_ERROR:
            return "same"
        return "labctl better" if ratio < 1 else "labctl worse"


@dataclass(frozen=True)
class Compared:
    """A recording with its rows and what labctl says beside them."""

    recording: Recording
    rows: list[Row]
    answer: Answer

    @property
    def furthest(self) -> Row:
        """The coefficient that differs most."""
        return max((row for row in self.rows if not row.is_error), key=lambda row: abs(row.difference))


def compared(recording: Recording, folder: Path) -> Compared:
    """Return a recording by both."""
    answer = recording.asked(Commands(folder))
    return Compared(recording, rows_of(answer.found, recording.independent()), answer)


def rows_of(labctl: Found, independent: Found) -> list[Row]:
    """Return the quantities that both state."""
    return [Row(name, labctl[name], independent[name]) for name in independent if name in labctl]


def all_compared() -> list[Compared]:
    """Return every recording by both."""
    with TemporaryDirectory() as folder:
        return [compared(recording, Path(folder)) for recording in RECORDINGS]


def figures(value: Value) -> str:
    """Return a value with U (k = 2) in as many digits as U has meaning; four digits where none is stated."""
    if not math.isfinite(value.u) or value.u <= 0:
        return f"{value.value:.4g}"
    digits = max(0, 1 - math.floor(math.log10(2 * value.u)))
    return f"{value.value:.{digits}f} +- {2 * value.u:.{digits}f}"
