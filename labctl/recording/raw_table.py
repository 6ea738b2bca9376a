"""A log file as it was read: named columns under the file's own names, before a column map says what they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.recording.unread import Unread

#: Rows of a file that a preview shows.
SHOWN_ROWS = 8


@dataclass(frozen=True)
class RawColumn:
    """One column of a file, n rows.

    `values` are its numbers, (n,), nan where a cell is empty or no number; `words` its texts where it holds texts.
    `unit` is what the format itself says, empty where it says nothing. `wrong` are the first cells of a column of
    numbers that are no numbers, as (row, text), of `n_wrong`; rows count from 1. `is_boolean`: the format says that
    the values are true (1) and false (0), which are no readings.
    """

    name: str
    values: NDArray[np.float64]
    words: NDArray[np.str_] | None = None
    unit: str = ""
    wrong: tuple[tuple[int, str], ...] = ()
    n_wrong: int = 0
    is_boolean: bool = False

    @property
    def is_text(self) -> bool:
        """Whether it holds words."""
        return self.words is not None

    @property
    def is_number(self) -> bool:
        """Whether its values can be readings: neither words nor true and false."""
        return not self.is_text and not self.is_boolean

    @property
    def is_empty(self) -> bool:
        """Whether no cell holds anything."""
        return not self.is_text and not self.n_wrong and not bool(np.isfinite(self.values).any())


@dataclass(frozen=True)
class FileLayout:
    """How a text file is divided: `header` and `data` are the lines, from 1, of the names (0: none) and of row 1."""

    encoding: str
    separator: str
    decimal: str
    header: int
    data: int


@dataclass(frozen=True)
class RawTable:
    """What a file holds. `problems` are lines about rows that could not be read.

    `targets` are the columns of a recording that a format with fixed names has, as file's column -> recording's.
    `facts` are keys of recording.toml that the file itself states.
    """

    path: Path
    columns: Mapping[str, RawColumn]
    rows: int
    problems: tuple[str, ...] = ()
    layout: FileLayout | None = None
    targets: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    first_rows: Sequence[Sequence[str]] = ()
    started_at: datetime | None = None
    unread: Unread | None = None  #: what of the file could not be read

    def shown_rows(self) -> list[list[str]]:
        """Return the first rows as text, at most SHOWN_ROWS."""
        if self.first_rows:
            return [list(row) for row in self.first_rows[:SHOWN_ROWS]]
        return [[_cell(column, row) for column in self.columns.values()] for row in range(min(self.rows, SHOWN_ROWS))]


def _cell(column: RawColumn, row: int) -> str:
    if column.words is not None:
        return str(column.words[row])
    if column.is_boolean and np.isfinite(column.values[row]):
        return "true" if column.values[row] else "false"
    return f"{column.values[row]:.9g}"
