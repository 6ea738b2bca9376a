"""Error figures, input-referred, deg/s: one value per data set and axis, root mean square over all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from labctl.answers.fitted_model import ErrorFiguresJson, LegErrorJson
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.numeric.arrays import Array


@dataclass(frozen=True)
class ErrorFigures:
    """The figures of a calibration; None where one cannot be had."""

    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None
    noise_floor_source: str = "none"
    heldout_by_leg: tuple[LegErrorJson, ...] = ()  #: where the temperature goes both ways

    def to_dict(self) -> ErrorFiguresJson:
        """Return this as JSON."""
        return {
            "raw_rms_dps": self.raw_rms_dps,
            "rms_dps": self.rms_dps,
            "heldout_rms_dps": self.heldout_rms_dps,
            "noise_floor_dps": self.noise_floor_dps,
            "noise_floor_source": self.noise_floor_source,
            "heldout_by_leg": list(self.heldout_by_leg),
        }


@dataclass(frozen=True)
class ErrorSummary:
    """Mean, standard deviation, RMS and largest size of a set of errors: RMS^2 = mean^2 + SD^2."""

    mean_dps: float
    sd_dps: float
    rms_dps: float
    max_dps: float

    @staticmethod
    def of(errors: Array) -> ErrorSummary:
        """Return the figures of errors (n,), n >= 1."""
        return ErrorSummary(
            float(errors.mean()), float(errors.std()), float(np.sqrt(np.mean(errors**2))), float(np.abs(errors).max())
        )


def rms(errors: Mapping[str, Array]) -> float | None:
    """Return the root mean square over axes and data sets, unweighted; None when there are none."""
    pooled = np.concatenate([values[np.isfinite(values)] for values in errors.values()] or [np.zeros(0)])
    return float(np.sqrt(np.mean(pooled**2))) if len(pooled) else None


def first_of_smallest(errors_dps: Sequence[float], n: int) -> int:
    """Return which of several root mean squares of n errors is the smallest, or the first that is not clearly larger.

    One is clearly larger by more than two of its standard uncertainties, each 1 / sqrt(2 n) of it; n = 0: unknown, so
    every difference is.
    """
    clear = min(errors_dps) * (1.0 + (2.0 / np.sqrt(2.0 * n) if n else 0.0))
    return next(place for place, error in enumerate(errors_dps) if error <= clear)


def by_turning_axis(data: FitData, errors: Mapping[str, Array]) -> dict[str, dict[str, ErrorSummary]]:
    """Return the figures by axis that turns and output axis, as in Yang et al. 2018, Tables 3 and 4."""
    turning = np.char.lstrip(np.asarray(data.channels["position"]).astype(np.str_), "-")
    return {
        str(axis): {output: ErrorSummary.of(values[turning == axis]) for output, values in errors.items()}
        for axis in np.unique(turning)
    }
