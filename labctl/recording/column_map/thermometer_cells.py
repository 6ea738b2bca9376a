"""A thermometer that is asked more seldom than the gyro: the empty cells between its readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.problems import Problems, rows_text

Array = NDArray[np.float64]
#: Readings of a thermometer that are needed, and the longest time between two, or beyond the first and last, s.
LEAST_KNOWN, LONGEST_S = 2, 120.0


def is_thermometer(target: str) -> bool:
    """Whether a column of a recording holds what a thermometer reads."""
    return target.endswith("_c") and not target.endswith("_setpoint_c")


def fill_between(columns: dict[str, NDArray[np.generic]], t_s: Array, problems: Problems) -> str:
    """Fill empty cells of thermometers, at times (n,) s, by straight lines between their readings; says which.

    Before the first and after the last reading the nearest one stands. A problem where readings are too few or too far
    apart: what the temperature did between them is then not known.
    """
    said = []
    for name in filter(is_thermometer, columns):
        values = np.asarray(columns[name], dtype=np.float64)
        known = np.isfinite(values)
        n = int((~known).sum())
        if n == 0:
            continue
        if known.sum() < LEAST_KNOWN:
            problems.add(
                f"{name}: {n} of {len(values)} cells are empty; leave the column out of the map, or fill it in"
            )
            continue
        order = np.argsort(t_s[known], kind="stable")
        at, read = t_s[known][order], values[known][order]
        after = np.searchsorted(at, t_s)
        before_s = t_s - at[np.maximum(after - 1, 0)]
        after_s = at[np.minimum(after, len(at) - 1)] - t_s
        apart_s = np.where((after > 0) & (after < len(at)), before_s + after_s, np.abs(np.maximum(before_s, after_s)))
        far = ~known & (apart_s > LONGEST_S)
        if far.any():
            problems.add(
                f"{name}, {rows_text(far)}: empty, and the thermometer was not read for "
                f"{float(apart_s[far].max()):.4g} s (at most {LONGEST_S:g} s are filled in); fill in or leave out "
                "these rows"
            )
            continue
        columns[name] = np.where(known, values, np.interp(t_s, at, read))
        longest_s = float(apart_s[~known].max())
        said.append(
            f"{name}: {n} of {len(values)} cells are empty and were filled in by straight lines between the "
            f"thermometer's readings, at most {longest_s:.3g} s apart"
        )
    return "; ".join(said)
