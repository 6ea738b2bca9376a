"""The data sets of a plan before they are measured, as a fit will see them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import body_rates
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.design.heat_course import HeatCourse
from labctl.fitting.design.noise_figures import NoiseFigures
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, RecordingInfo

#: Any day: no result depends on it.
STARTED = datetime(2026, 1, 1, tzinfo=UTC)
#: Readings of a data set; the noise of its mean is what counts.
READINGS = 100
#: Every so many values of a course are written to the log of the environment.
LOGGED = 3


@dataclass(frozen=True)
class PlannedSets:
    """The m data sets of a plan."""

    begin_s: Array  #: (m,) first reading, s from the start
    duration_s: Array  #: (m,)
    rate_dps: Array  #: (m,) of the table
    position: NDArray[np.str_]  #: (m,) body axis along the table axis
    run: NDArray[np.int64]  #: (m,) powered session
    mounting: NDArray[np.int64]  #: (m,)
    on_s: Array  #: (m,) since the units were switched on
    heat: HeatCourse
    supply_v: Array | None = None  #: (m,) voltage of the units' supply, where the bench sets it

    def __len__(self) -> int:
        return len(self.rate_dps)

    @property
    def middle_s(self) -> Array:
        """The middle of each data set, (m,) s."""
        return np.asarray(self.begin_s + self.duration_s / 2)

    @property
    def temperature_c(self) -> Array:
        """The unit's mean temperature in each data set, (m,) deg C."""
        return self.heat.mean_c(self.begin_s, self.begin_s + self.duration_s)

    @property
    def slope_k_s(self) -> Array:
        """How fast the unit's temperature changes in each data set, (m,) K/s."""
        return self.heat.slope_k_s(self.begin_s, self.begin_s + self.duration_s)


def planned_data(sets: PlannedSets, axes: Sequence[str], noise: NoiseFigures) -> FitData:
    """Return planned data sets as data of a fit: outputs without error, and the noise that their means will have."""
    rates = body_rates(sets.rate_dps, sets.position)
    temperatures_c = sets.temperature_c
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(1, len(sets) + 1), "t_s": sets.middle_s, "run": sets.run, "mounting": sets.mounting,
        "position": sets.position, "table_rate_dps": sets.rate_dps, "temperature_c": temperatures_c,
        "power_s": sets.on_s, "duration_s": sets.duration_s, "n": np.full(len(sets), READINGS),
    }  # fmt: skip
    columns |= {} if sets.supply_v is None else {"supply_v": sets.supply_v}
    for axis in axes:
        white = np.sqrt(noise.of(axis).white_var(sets.duration_s))
        columns |= {f"gyro_{axis}": rates[axis], f"gyro_{axis}_std": np.sqrt(READINGS) * white}
    head = {"serial": "planned", "axes": tuple(axes), "kind": "points", "started_at": STARTED}
    info = RecordingInfo.model_validate(head)
    return fit_data_of(Recording(info, columns, _environment(sets)))


def _environment(sets: PlannedSets) -> Mapping[str, NDArray[np.generic]]:
    """Return the log of the temperatures, with the powered session that is in force; nothing before the first."""
    heat = sets.heat
    t_s, unit_c, air_c = heat.t_s[::LOGGED], heat.unit_c[::LOGGED], heat.air_c[::LOGGED]
    order = np.searchsorted(sets.begin_s, t_s, side="right")
    run = sets.run[np.minimum(order, len(sets) - 1)]
    return {"t_s": t_s, "run": run, "temperature_c": unit_c, "chamber_c": air_c}
