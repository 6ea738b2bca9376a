"""Error after a full turn, and the static bias before a mission (Ojeda et al. 2000, eqs. 1 and 14 to 16)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, NotEnoughData

#: The error per turn grows without bound towards rest.
MIN_RATE_DPS = 5.0
#: Below this rate the table is at rest; the Earth turns at 0.004 deg/s.
AT_REST_DPS = 0.01
MIN_READINGS = 10


def error_per_turn(error_dps: NDArray[np.float64], rate_dps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the error after one turn of 360 deg, (n,) deg, of rate errors (n,) deg/s at table rates (n,) deg/s.

    Eq. 14 is error x sampling rate x time for an error per sample; for an error in deg/s it is error x time, with
    360 / |rate| seconds for a turn. Raises BadInput below 5 deg/s.
    """
    slow = np.abs(rate_dps) < MIN_RATE_DPS
    if np.any(slow):
        raise BadInput(
            f"rate {float(np.asarray(rate_dps)[slow][0]):g} deg/s: the error per turn is defined only for rates "
            f"of {MIN_RATE_DPS:g} deg/s or more; use the error in deg/s instead"
        )
    return error_dps * 360.0 / np.abs(rate_dps)


def turn_errors(error_dps: NDArray[np.float64], rate_dps: NDArray[np.float64]) -> list[float | None]:
    """Return the error after one turn, deg, of n data sets; None below the least rate, or without an error."""
    is_known = (np.abs(rate_dps) >= MIN_RATE_DPS) & np.isfinite(error_dps)
    per_turn_deg = np.full(len(rate_dps), np.nan)
    per_turn_deg[is_known] = error_per_turn(error_dps[is_known], rate_dps[is_known])
    return [float(value) if ok else None for value, ok in zip(per_turn_deg, is_known, strict=True)]


def bias_at_rest(
    error_dps: NDArray[np.float64],
    rate_dps: NDArray[np.float64],
    temperature_c: NDArray[np.float64],
    position: NDArray[np.str_],
) -> NDArray[np.float64]:
    """Return the static bias that would have been taken before each of n data sets, (n,) deg/s (eqs. 1 and 15).

    It is the mean error at rest in the same position, linearly interpolated to the data set's temperature; a position
    that was never at rest takes that of all positions. NaN where nothing was measured at rest.
    """
    rest = np.abs(rate_dps) < AT_REST_DPS
    bias = np.full(len(error_dps), np.nan)
    for up_axis in np.unique(position):
        in_position = position == up_axis
        from_ = rest & in_position if np.any(rest & in_position) else rest
        if np.any(from_):
            temperatures_c, which = np.unique(temperature_c[from_], return_inverse=True)
            bias[in_position] = np.interp(
                temperature_c[in_position], temperatures_c, np.bincount(which, error_dps[from_]) / np.bincount(which)
            )
    return bias


@dataclass(frozen=True)
class StaticBias:
    """The output at rest before a mission, to be taken off during it (eq. 16). It contains the Earth's rate there."""

    bias_dps: float
    u_dps: (
        float  #: standard uncertainty: white noise of the mean, and the bias instability that averaging cannot remove
    )
    readings: int


def static_bias(at_rest_dps: NDArray[np.float64], instability_dps: float = 0.0) -> StaticBias:
    """Return the mean of readings at rest, (n,) deg/s, raw (eq. 1) or compensated (eq. 15), with its uncertainty.

    10 to 20 s of readings are usual. Raises NotEnoughData for fewer than 10 readings.
    """
    n = len(at_rest_dps)
    if n < MIN_READINGS or not np.all(np.isfinite(at_rest_dps)):
        raise NotEnoughData(
            f"a static bias needs at least {MIN_READINGS} finite readings at rest; {n} were given, record more"
        )
    white = float(np.std(at_rest_dps, ddof=1)) / np.sqrt(n)
    return StaticBias(float(np.mean(at_rest_dps)), float(np.hypot(white, instability_dps)), n)
