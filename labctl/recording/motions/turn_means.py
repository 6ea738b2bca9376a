"""Means over a turn: the integral of the output between the first and the last reading, over that time.

A turn of `turn_deg` is the integral of the true rate from the first to the last valid reading of its data set. Divided
by that time it is a mean rate, and the trapezoidal mean of the output over the same time is scale factor times it plus
bias, for any course of the rate between, as long as the output is linear in the rate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.recording.recording import Columns, Recording

#: Ending of the column that holds what uncertain time stamps leave in the mean of a gyro column.
TIME = "_time_std"
#: Readings that an integral takes.
LEAST = 2
#: From the median of absolute values to a standard deviation.
_ROBUST = 1.4826


def turned_points(
    rows: Columns, points: Columns, starts: NDArray[np.int64], counts: NDArray[np.int64]
) -> dict[str, NDArray[np.generic]]:
    """Return the columns of m points in which a turn differs from a data set at one rate.

    `rows` are the valid readings (n,), of which data set k is the `counts[k]` from `starts[k]` on, `points` their
    plain means (m,). Time and gyro columns become those between the first and the last reading: `duration_s`, the
    trapezoidal mean, `table_rate_dps` as the mean rate, and `gyro_*_time_std`.
    """
    t_s = np.asarray(rows["t_s"], dtype=np.float64)
    sets = [slice(int(begin), int(begin + n)) for begin, n in zip(starts, counts, strict=True)]
    length = np.array([t_s[span][-1] - t_s[span][0] for span in sets])
    lasting_s = np.maximum(length, 1e-12)
    turn = np.asarray(points["turn_deg"], dtype=np.float64)
    point_recording: dict[str, NDArray[np.generic]] = {
        "duration_s": length,
        "table_rate_dps": np.where(turn != 0, turn / lasting_s, 0.0),
    }
    for name, values in rows.items():
        if not name.startswith("gyro_"):
            continue
        readings = np.asarray(values, dtype=np.float64)
        point_recording[name] = np.array([trapezoidal_mean(t_s[span], readings[span]) for span in sets])
        point_recording[f"{name}{TIME}"] = np.array([_time_std(t_s[span], readings[span]) for span in sets])
    return point_recording


def trapezoidal_mean(t_s: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Return the mean of values (n,) at times (n,) over the time from the first to the last, by trapezoids."""
    if len(values) < LEAST:
        return float(values.mean())
    return float(np.trapezoid(values, t_s) / (t_s[-1] - t_s[0]))


def _time_std(t_s: NDArray[np.float64], values: NDArray[np.float64]) -> float:
    """Return what the scatter of time stamps leaves in the mean of values, both (n,).

    A stamp that is off by d moves the area beside it by d times half of the change of the output about it. Stamps
    scatter as their spacing does: by its standard deviation over the root of 2.
    """
    if len(values) < 2 * LEAST:
        return 0.0
    steps = np.diff(t_s)
    u_s = _ROBUST * float(np.median(np.abs(steps - np.median(steps)))) / np.sqrt(2)
    change = (values[2:] - values[:-2]) / 2
    return float(u_s * np.sqrt(np.sum(change**2)) / (t_s[-1] - t_s[0]))


def rates_as_turned(recording: Recording) -> NDArray[np.float64]:
    """Return the rate of each reading about its position's axis as the output says, (n,) deg/s; 0 at rest.

    It says how fast a turn went, by the nominal scale factor; a mean over the turn says less. Where the axis that was
    turned about has no output, the mean stands for it.
    """
    columns = recording.columns
    rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    turned_dps, position = rate.copy(), np.asarray(columns["position"]).astype(np.str_)
    for axis in recording.info.axes:
        output = recording.gyro_dps(axis)
        turned_dps[position == axis] = output[position == axis]
        turned_dps[position == f"-{axis}"] = -output[position == f"-{axis}"]
    return np.where(rate == 0, 0.0, turned_dps)
