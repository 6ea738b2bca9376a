"""A recording in memory: named columns with units, in the order in which they were measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from labctl.recording.info import RecordingInfo

#: One column: numbers, whole numbers or texts, (n,).
Column = NDArray[np.generic]
Columns = Mapping[str, Column]


@dataclass(frozen=True)
class Recording:
    """Everything measured on one unit in one campaign.

    `columns` holds the columns of the interchange format under their own names, n rows each: one row per reading
    (kind "samples"), per data set ("points") or per temperature ("coefficients"). Gyro columns stay in the output's
    own unit; `gyro_dps` converts them. A column that is absent is unknown, never zero.
    """

    info: RecordingInfo
    columns: Columns
    environment: Columns | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def gyro_dps(self, axis: str) -> NDArray[np.float64]:
        """Return the output of one axis as a rate, (n,) deg/s, by its nominal scale factor and offset."""
        raw = np.asarray(self.columns[f"gyro_{axis}"], dtype=np.float64)
        output = next((output_unit for name, output_unit in self.info.output.items() if name == axis), None)
        return raw if output is None else (raw - output.offset) / output.scale


#: The thermometer of a unit, and what stands in for it.
TEMPERATURES_OF_UNIT = ("temperature_c", "chamber_c")


def temperature_of(columns: Columns) -> NDArray[np.float64] | None:
    """Return how warm the unit was, (n,) deg C, or None where no column gives it.

    The one place that decides: the unit's own thermometer, and where it has none the chamber's stands in for it.
    """
    temperatures_c = next((columns[name] for name in TEMPERATURES_OF_UNIT if name in columns), None)
    return None if temperatures_c is None else np.asarray(temperatures_c, dtype=np.float64)
