"""Repeatability of the output at rest from one power-on to the next: what a calibration owes to later days."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from instruments.datasheet import LIMITS, Convention
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.numeric.arrays import Array
from labctl.recording import RecordingInfo

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
    text: str = ""  #: of a data sheet: the figure, its convention and what follows from it
    convention: Convention | None = None  #: of the data sheet

    @property
    def name(self) -> str:
        """Where the figure is from, with the convention of a data sheet."""
        return f"{self.source}, {self.convention}" if self.convention else self.source

    @property
    def distribution(self) -> str:
        """The distribution: the difference of two errors within the same limits is triangular."""
        return "triangular" if self.convention in LIMITS else "normal"


def repeatability_of(
    data: FitData, residual_dps: Mapping[str, Array], instability_dps: Mapping[str, float | None]
) -> dict[str, Repeatability | None]:
    """Return axis -> repeatability: between runs, by the data sheet, or by a static record; None where none tells.

    `instability_dps` is each axis' bias instability by a static record. The scatter between runs is pooled over the
    axes; two or three runs say little of a standard deviation, which Student's t answers for.
    """
    between = _between_runs(data, residual_dps)
    by_axis: dict[str, Repeatability | None] = {}
    for axis in residual_dps:
        measured = instability_dps.get(axis)
        if between is not None:
            by_axis[axis] = between
        elif sheet := by_datasheet(data.info):
            by_axis[axis] = sheet
        elif measured:
            by_axis[axis] = Repeatability(OF_TWO * DRIFT_OVER_INSTABILITY * measured, "static record")
        else:
            by_axis[axis] = None
    return by_axis


def by_datasheet(info: RecordingInfo) -> Repeatability | None:
    """Return what the data sheet states by its convention; None where it states nothing."""
    for name in ("bias_repeatability_dps", "bias_stability_dps"):
        if figure := info.datasheet_figure(name):
            text = f"{figure.text}; times sqrt(2), for the run that was calibrated and the one that is corrected"
            return Repeatability(OF_TWO * figure.u, "data sheet", None, text, figure.convention)
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
