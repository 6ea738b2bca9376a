"""Numbers of named columns of a table that holds the readings of one sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadRecording


def numbers_of(
    path: Path, table: Mapping[str, NDArray[np.generic]], columns: Sequence[str], wanted: str
) -> NDArray[np.float64]:
    """Return columns of a table as numbers (n, k); `wanted` says in words what they are.

    Raises BadRecording for a column that is not there or holds text, and for a row without a number in each.
    """
    numbers = []
    for name in columns:
        if name not in table:
            raise BadRecording(
                f"{path}: there is no column {name!r} (the columns are {', '.join(list(table)[:12])}); name {wanted} "
                "with --columns"
            )
        values = np.asarray(table[name])
        if values.dtype.kind not in "fiu":
            raise BadRecording(f"{path}: column {name!r} holds text, not numbers; name another column")
        numbers.append(np.asarray(values, dtype=np.float64))
    rows = np.column_stack(numbers)
    wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(wrong):
        raise BadRecording(f"{path}: row {int(wrong[0]) + 1} has no number in every column; leave the row out")
    return rows
