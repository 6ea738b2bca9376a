"""Columns by motion of a recording whose data sets have a rate: at rest, in turns, of a profile."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.rate_profile import Response
from labctl.fitting.data.temperature.legs import legs_of
from labctl.fitting.numeric.arrays import Array
from labctl.services.schemas.comparison import ProfileColumns, RestColumns, TurnColumns

#: Rows of one axis that a picture of a profile takes.
MOST_ROWS = 6000
#: axis -> (m,) corrected minus true rate, deg/s; None without a version.
Errors = Mapping[str, Array] | None
_Rows = dict[str, list[Any]]
LEGS = {1: "heating", -1: "cooling", 0: ""}


def rest_columns(data: FitData, errors: Errors) -> RestColumns:
    """Return the data sets at rest, axis by axis, in order of time."""
    channels, m = data.channels, len(data)
    t_s, known = channels.columns.get("t_s"), channels.history.thermometer
    run = np.asarray(channels["run"], dtype=np.int64) if "run" in channels else np.ones(m, dtype=np.int64)
    legs = np.sign(legs_of(data.temperature_c, run)) if known and t_s is not None else np.zeros(m, dtype=np.int64)

    def of(axis: str) -> _Rows:
        bias, left = data.outputs[axis] - data.true_rate_dps(axis), _left(errors, axis)
        return {
            "axis": [axis] * m,
            "dataset": _dataset(data),
            "t_s": _optional(t_s, m),
            "temperature_c": _optional(channels.temperature_c(axis) if known else None, m),
            "leg": [LEGS[int(leg)] for leg in legs],
            "bias_dps": bias.tolist(),
            "u_dps": _optional(None if data.white_var is None else np.sqrt(data.white_var[axis]), m),
            "modelled_dps": _optional(None if left is None else bias - left, m),
            "residual_dps": _optional(left, m),
        }

    return RestColumns(**_joined(data, errors, of))


def turn_columns(data: FitData, errors: Errors) -> TurnColumns:
    """Return the turns, axis by axis; rests between them are left out."""
    rows = np.flatnonzero(data.channels.table_rate_dps() != 0)
    m, duration_s = len(rows), data.channels.durations_s()[rows]
    about = np.asarray(data.channels["position"]).astype(np.str_)[rows].tolist()

    def of(axis: str) -> _Rows:
        left, true = _left(errors, axis), data.true_rate_dps(axis)[rows]
        left = None if left is None else left[rows]
        u_dps = None if data.white_var is None else np.sqrt(data.white_var[axis][rows])
        return {
            "axis": [axis] * m,
            "dataset": np.asarray(_dataset(data))[rows].tolist(),
            "about": about,
            "asked_deg": (true * duration_s).tolist(),
            "output_deg": (data.outputs[axis][rows] * duration_s).tolist(),
            "corrected_deg": _optional(None if left is None else (true + left) * duration_s, m),
            "residual_deg": _optional(None if left is None else left * duration_s, m),
            "u_deg": _optional(None if u_dps is None else u_dps * duration_s, m),
        }

    return TurnColumns(**_joined(data, errors, of))


def profile_columns(data: FitData, errors: Errors, responses: Mapping[str, Response]) -> ProfileColumns:
    """Return the windows of a profile, axis by axis, at most `MOST_ROWS` of each; `responses` are a version's."""
    rows = picked(len(data))
    m = len(rows)

    def of(axis: str) -> _Rows:
        left, true, followed = _left(errors, axis), data.true_rate_dps(axis), None
        if left is not None and axis in responses:
            followed = (true + left - data.through(responses[axis]).true_rate_dps(axis))[rows]
        return {
            "axis": [axis] * m,
            "dataset": np.asarray(_dataset(data))[rows].tolist(),
            "t_s": np.asarray(data.channels["t_s"], dtype=np.float64)[rows].tolist(),
            "true_dps": true[rows].tolist(),
            "output_dps": data.outputs[axis][rows].tolist(),
            "residual_dps": _optional(None if left is None else left[rows], m),
            "followed_dps": _optional(followed, m),
        }

    return ProfileColumns(**_joined(data, errors, of))


def _joined(data: FitData, errors: Errors, of: Callable[[str], _Rows]) -> _Rows:
    """Return the columns of all axes one below the other."""
    parts = [of(axis) for axis in data.info.axes if errors is None or axis in errors]
    return {name: [value for part in parts for value in part[name]] for name in parts[0]} if parts else {}


def picked(n: int) -> NDArray[np.int64]:
    """Return the rows that are drawn: all of n, or `MOST_ROWS` of them evenly."""
    return np.unique(np.linspace(0, n - 1, min(n, MOST_ROWS)).round().astype(np.int64))


def _left(errors: Errors, axis: str) -> Array | None:
    return None if errors is None else errors[axis]


def _dataset(data: FitData) -> list[int]:
    return [int(number) for number in np.rint(np.asarray(data.channels["dataset"], dtype=np.float64))]


def _optional(values: NDArray[np.generic] | None, n: int) -> list[float | None]:
    if values is None:
        return [None] * n
    numbers = np.asarray(values, dtype=np.float64).tolist()
    return [value if np.isfinite(value) else None for value in numbers]
