"""Repeatability of the output at rest from one power-on to the next: what a calibration owes to later days."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.numeric.arrays import Array

#: Data sheets state stability and repeatability as limits of about two standard deviations.
DATASHEET_SHARE = 0.5
#: The drift whose Allan deviation is as high as a bias instability B, over B.
DRIFT_OVER_INSTABILITY = 1.35
#: One run was calibrated and another is corrected: both are off, independently.
OF_TWO = float(np.sqrt(2.0))


@dataclass(frozen=True)
class Repeatability:
    """Standard uncertainty by which a later power-on is off, deg/s, and where the figure is from."""

    u_dps: float
    source: str
    freedom: int | None = None  #: degrees of freedom of the figure; None where it is stated and not estimated


def repeatability_of(
    data: FitData, residual_dps: Mapping[str, Array], instability_dps: Mapping[str, float | None]
) -> dict[str, Repeatability | None]:
    """Return axis -> repeatability: between runs, by the data sheet, or by a static record; None where none tells.

    `instability_dps` is each axis' bias instability by a static record. The scatter between runs is pooled over the
    axes; two or three runs say little of a standard deviation, which Student's t answers for.
    """
    between = _between_runs(data, residual_dps)
    found: dict[str, Repeatability | None] = {}
    for axis in residual_dps:
        measured = instability_dps.get(axis)
        if between is not None:
            found[axis] = between
        elif sheet := _by_datasheet(data):
            found[axis] = Repeatability(OF_TWO * sheet, "data sheet")
        elif measured:
            found[axis] = Repeatability(OF_TWO * DRIFT_OVER_INSTABILITY * measured, "static record")
        else:
            found[axis] = None
    return found


def _by_datasheet(data: FitData) -> float | None:
    for name in ("bias_repeatability_dps", "bias_stability_dps"):
        if data.info.datasheet.get(name):
            return DATASHEET_SHARE * float(data.info.datasheet[name])
    return None


def _between_runs(data: FitData, residual_dps: Mapping[str, Array]) -> Repeatability | None:
    """Return the scatter of the runs' mean residuals about each other, with the run to come."""
    if "run" not in data.channels:
        return None
    runs = np.asarray(data.channels["run"])
    numbers = np.unique(runs)
    if len(numbers) < 2:
        return None
    means = np.array([[values[runs == number].mean() for number in numbers] for values in residual_dps.values()])
    freedom = means.shape[0] * (len(numbers) - 1)
    variance = float(np.sum((means - means.mean(axis=1, keepdims=True)) ** 2)) / freedom
    return Repeatability(float(np.sqrt(variance * (1 + 1 / len(numbers)))), "between runs", freedom)
