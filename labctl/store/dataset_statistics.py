"""The figures of one data set, channel by channel: mean, standard deviation, white level and number of readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.columns import READING_TIMES, VERIFICATION
from labctl.recording.spread import MIN_FOR_SPECTRUM, white_std

#: Columns that are not measured channels: no mean is stored for them.
NOT_CHANNELS = frozenset(
    {
        "dataset",
        "t_s",
        "position",
        "run",
        "mounting",
        "table_rate_dps",
        "table_angle_deg",
        "power_s",
        "valid",
        VERIFICATION,
        *READING_TIMES,
    }
)


#: Column of a table -> value, which SQL and JSON take as it is.
Row = dict[str, str | int | float | bool | None]


@dataclass(frozen=True)
class Statistics:
    """Figures of one channel in one data set, in the channel's unit."""

    mean: float | None
    std: float | None
    white_std: float | None
    n: int


def statistics(values: NDArray[np.float64], *, spectrum: bool) -> Statistics:
    """Return the figures of valid readings (n,); the white level only with `spectrum`."""
    n = len(values)
    if n == 0:
        return Statistics(None, None, None, 0)
    return Statistics(
        float(values.mean()),
        float(values.std(ddof=1)) if n > 1 else None,
        white_std(values) if spectrum and n >= MIN_FOR_SPECTRUM else None,
        n,
    )


def means_rows(
    recording: int, number: int, columns: Mapping[str, NDArray[np.generic]], valid: NDArray[np.bool_]
) -> list[Row]:
    """Return the rows of data_set_means of one data set; only valid readings count."""
    rows: list[Row] = []
    for name, values in columns.items():
        if name in NOT_CHANNELS or values.dtype.kind not in "fiu":
            continue
        figures = statistics(values[valid].astype(np.float64), spectrum=name.startswith("gyro_"))
        rows.append(
            {
                "recording_id": recording,
                "number": number,
                "channel": name,
                "mean": figures.mean,
                "std": figures.std,
                "white_std": figures.white_std,
                "n": figures.n,
            }
        )
    return rows
