"""A simulated unit that sends by itself, a sample of the world in each of its sampling intervals."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from instruments.simulators.setup import InstrumentSetup


class SampledUnit:
    """The sampling of such a unit; a device turns the samples into bytes."""

    def __init__(self, setup: InstrumentSetup, axes: Sequence[str], most: int) -> None:
        """`most` is how many samples its port keeps unread."""
        self._unit, self._world, self._faults = setup.unit, setup.world, setup.faults
        self._rate_hz = self._unit.sample_rate_hz
        self._axes, self._most = axes, most
        simulation = self._world.settings  # of the unit's own noise no number is taken
        self._rng = np.random.default_rng(
            [simulation.seed, simulation.noise_seed, zlib.crc32(setup.gyro.serial.encode())]
        )
        self._sent = 0  #: index of the newest sample sent

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes without a reply."""

    @property
    def newest_s(self) -> float:
        """When the newest sample was complete, s."""
        return self._sent / self._rate_hz

    def skip(self, t_s: float) -> None:
        """Drop the samples up to `t_s`."""
        self._sent = max(self._sent, self._newest(t_s))

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the unit never waits
        """Return when the next sample is complete."""
        return (self._sent + 1) / self._rate_hz

    def _due(self, t_s: float) -> NDArray[np.int64]:
        """Return the indices, (n,), of the samples up to `t_s` that were not sent yet; they are sent now."""
        newest = self._newest(t_s)
        index = np.arange(max(self._sent + 1, newest - self._most + 1), newest + 1, dtype=np.int64)
        self._sent = max(self._sent, newest)
        return index

    def _newest(self, t_s: float) -> int:
        return math.floor(t_s * self._rate_hz + 1e-9)

    def _values(self, index: NDArray[np.int64]) -> dict[str, NDArray[np.float64]]:
        """Return channel -> its values, (n,), in the unit of a recording, of the samples `index` (n,)."""
        sample = self._unit.sample(index / self._rate_hz)
        force = self._world.specific_force(index / self._rate_hz, sample.table_dps)
        if self._unit.truth.accel_noise_g > 0:
            force = force + self._unit.truth.accel_noise_g * self._rng.standard_normal(force.shape)
        values = {"temperature_c": sample.temperature_c[:, 0], "supply_v": sample.supply_v}
        for column, axis in enumerate(self._axes):
            values[f"gyro_{axis}"] = sample.rate_dps[:, column]
            values[f"temperature_{axis}_c"] = sample.temperature_c[:, column]
        for column, body_axis in enumerate("xyz"):
            values[f"accel_{body_axis}_g"] = force[:, column]
        return values
