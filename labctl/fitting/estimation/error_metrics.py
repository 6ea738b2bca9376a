"""Error figures, input-referred, deg/s: one value per data set and axis, root mean square over all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.levels import SAME_TEMPERATURE_C
from labctl.fitting.numeric.arrays import Array


@dataclass(frozen=True)
class ErrorFigures:
    """The four figures of a calibration; None where one cannot be had."""

    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None
    noise_floor_source: str = "none"

    def to_dict(self) -> dict[str, Any]:
        """Return this as JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Spread:
    """Mean, standard deviation, RMS and largest size of a set of errors: RMS^2 = mean^2 + SD^2."""

    mean_dps: float
    sd_dps: float
    rms_dps: float
    max_dps: float

    @staticmethod
    def of(errors: Array) -> Spread:
        """Return the figures of errors (n,), n >= 1."""
        return Spread(
            float(errors.mean()), float(errors.std()), float(np.sqrt(np.mean(errors**2))), float(np.abs(errors).max())
        )


def rms(errors: Mapping[str, Array]) -> float | None:
    """Return the root mean square over axes and data sets, unweighted; None when there are none."""
    pooled = np.concatenate([values[np.isfinite(values)] for values in errors.values()] or [np.zeros(0)])
    return float(np.sqrt(np.mean(pooled**2))) if len(pooled) else None


def by_turning_axis(data: FitData, errors: Mapping[str, Array]) -> dict[str, dict[str, Spread]]:
    """Return the figures by axis that turns and output axis, as in Yang et al. 2018, Tables 3 and 4."""
    turning = np.char.lstrip(np.asarray(data.channels["position"]).astype(np.str_), "-")
    return {
        str(axis): {output: Spread.of(values[turning == axis]) for output, values in errors.items()}
        for axis in np.unique(turning)
    }


#: Data sets closer than this in rate (of the fastest) and temperature repeat each other.
REPEAT_RATE = 1e-3
REPEAT_TEMPERATURE_C = SAME_TEMPERATURE_C
REPEATS_NEEDED = 8


def floor_from_repeats(data: FitData, residual: Mapping[str, Array]) -> float | None:
    """Return the noise of one data set from pairs that repeat a rate and a temperature; None when they are too few."""
    rate = np.asarray(data.channels["table_rate_dps"], dtype=np.float64)
    near_rate = REPEAT_RATE * max(float(np.abs(rate).max()), 1e-9)
    order = np.lexsort((data.temperature_c, np.round(rate / near_rate)))
    first, second = order[:-1], order[1:]
    close = (np.abs(rate[first] - rate[second]) <= near_rate) & (
        np.abs(data.temperature_c[first] - data.temperature_c[second]) <= REPEAT_TEMPERATURE_C
    )
    position = np.asarray(data.channels["position"])
    close &= position[first] == position[second]
    if close.sum() < REPEATS_NEEDED:
        return None
    differences = np.concatenate([(values[first] - values[second])[close] for values in residual.values()])
    return float(np.sqrt(np.mean(differences**2) / 2))
