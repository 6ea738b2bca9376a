"""Everything that is wrong with a file, gathered, so that all of it can be corrected at once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadFile

#: Problems that are listed of one file.
MAX_PROBLEMS = 20
#: Rows that one problem names.
MAX_ROWS = 5


class Problems:
    """Collects lines about one file; every line stands alone: what, where, value, what to do."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines: list[str] = []

    def add(self, line: str) -> None:
        """Add a line, once."""
        if line not in self.lines:
            self.lines.append(line)

    def listed(self) -> list[str]:
        """Return the lines, bounded."""
        more = len(self.lines) - MAX_PROBLEMS
        return self.lines[:MAX_PROBLEMS] + ([f"and {more} more problems"] if more > 0 else [])

    def raise_if_any(self) -> None:
        """Raise BadFile where something is wrong."""
        if self.lines:
            raise BadFile.of(self.path, self.listed())


def rows_text(wrong: NDArray[np.bool_] | Sequence[int], total: int | None = None) -> str:
    """Return rows, given as a mask or as numbers from 1, as words: `row 3`, or `rows 3, 7, 9 and 12 more`."""
    wrong_rows = (np.flatnonzero(wrong) + 1).tolist() if isinstance(wrong, np.ndarray) else list(wrong)
    n = len(wrong_rows) if total is None else total
    if n == 1:
        return f"row {wrong_rows[0]}"
    shown_rows = wrong_rows[:MAX_ROWS]
    more = n - len(shown_rows)
    return f"rows {', '.join(map(str, shown_rows))}" + (f" and {more} more" if more > 0 else "")
