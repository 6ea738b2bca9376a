"""The time of a reference rate that changes: an error of it moves a delay in full, and others by what it does to them.

An encoder is read by request and reply. When in between the angle was taken is not known, so the whole course is early
or late, and no number of readings averages that out: a consider covariance, as of coefficients that are held.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.response import DELAY
from labctl.fitting.models.error_part import ErrorPart
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.least_squares import Considered
from labctl.recording.columns import TIME_COMMON_U_S, TIME_U_S


@dataclass(frozen=True)
class TimeErrors:
    """Errors of the time of the reference: one that all data sets have in common, then one of each data set's own."""

    columns: NDArray[np.float64]  #: (m, 1 + j) change of the output, deg/s, by one standard uncertainty of each
    common_u_s: float
    own_u_s: float  #: root mean square over the data sets
    is_common_stated: bool = True  #: also as 0, where the time of the reference is known

    def beside(self, known: Considered | None) -> Considered:
        """Return these as considered columns behind those that are."""
        if known is None:
            return Considered(self.columns, np.zeros((len(self.columns), 0)), np.zeros(0))
        return replace(known, columns=np.column_stack([known.columns, self.columns]))

    def parts(self, along: NDArray[np.float64]) -> tuple[ErrorPart, ...]:
        """Return the parts of a covariance; `along` (k, 1 + j) is the change of the coefficients by each."""
        parts = (
            ErrorPart(TIME_COMMON_U_S.removesuffix("_u_s"), self.common_u_s, "s", along[:, :1]),
            ErrorPart(TIME_U_S.removesuffix("_u_s"), self.own_u_s, "s", along[:, 1:]),
        )
        return tuple(part for part in parts if part.u > 0 or (part is parts[0] and self.is_common_stated))


def time_errors(data: FitData, axis: str) -> TimeErrors | None:
    """Return the errors of the reference's time in one output; None where the rate is constant or nothing states them.

    Raises BadInput for an uncertainty below 0.
    """
    profile = data.channels.profile
    if profile is None or not (TIME_U_S in data.channels or TIME_COMMON_U_S in data.channels):
        return None
    own_s, common_s = (_stated(data, name) for name in (TIME_U_S, TIME_COMMON_U_S))
    slope = data.channels.up(axis) * profile.slope(DELAY, data.channels.response)
    sets = np.asarray(data.channels["dataset"], dtype=np.int64)
    by_set = [sets == number for number in np.unique(sets[own_s > 0])]
    columns = np.column_stack([slope * common_s, *(slope * own_s * rows for rows in by_set)])
    own_u_s = _rms(np.array([own_s[rows].mean() for rows in by_set]))
    return TimeErrors(columns, _rms(common_s[common_s > 0]), own_u_s, TIME_COMMON_U_S in data.channels)


def _stated(data: FitData, name: str) -> Array:
    """Return a column of uncertainties (m,) s, 0 where none is stated: of a rate that is constant no time matters."""
    if name not in data.channels:
        return np.zeros(len(data))
    values = np.asarray(data.channels[name], dtype=np.float64)
    if np.any(values < 0) or np.any(np.isinf(values)):
        worst = float(values[(values < 0) | np.isinf(values)][0])
        raise BadInput(
            f"{data.info.serial}: column {name!r} has {worst:g} s; give a standard uncertainty of at least 0 s, or "
            "leave the column out where none is known"
        )
    return np.nan_to_num(values)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
