"""A simulated gyro that sends the messages of any stream format, whether or not the port is read."""

from __future__ import annotations

import math
import zlib

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import part_of
from instruments.protocols.stream_formats.document import StreamField
from instruments.protocols.stream_formats.encoding import message
from instruments.protocols.stream_formats.readings import scale_of, stamp_ticks
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.simulators.setup import InstrumentSetup

#: Bytes of the shortest message: a port holds no more than its buffer.
SHORT_MESSAGE_BYTES = 12


class SimulatedStream:
    """Sends a message per sampling interval of the world's unit."""

    def __init__(self, setup: InstrumentSetup) -> None:
        settings = part_of(setup.gyro, StreamSettings)
        self._format = settings.format
        self._unit, self._faults, self._world = setup.unit, setup.faults, setup.world
        self._axes = tuple(settings.axes)
        self._rate_hz = self._unit.sample_rate_hz
        self._nominal_hz = settings.sample_rate_hz or self._rate_hz
        self._most = setup.port_buffer_bytes // SHORT_MESSAGE_BYTES
        simulation = self._world.settings  # of the unit's own noise no number is taken
        self._rng = np.random.default_rng(
            [simulation.seed, simulation.noise_seed, zlib.crc32(setup.gyro.serial.encode())]
        )
        self._sent = 0  #: index of the newest message sent

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes without a reply."""

    def transmit(self, t_s: float) -> bytes:
        """Return the messages up to `t_s`."""
        newest = self._newest(t_s)
        if newest <= self._sent:
            return b""
        index = np.arange(max(self._sent + 1, newest - self._most + 1), newest + 1)
        self._sent = newest
        columns = [(field.name, self._numbers(field, index)) for field in self._shown(index)]
        rows = zip(*(numbers.tolist() for _, numbers in columns), strict=True)
        names = [name for name, _ in columns]
        messages = [message(self._format, dict(zip(names, row, strict=True))) for row in rows]
        if self._faults.trigger(["wrong_crc"], t_s) is not None:
            messages[0] = messages[0][:-3] + bytes([messages[0][-3] ^ 0x55]) + messages[0][-2:]
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            messages = messages[gap.value :]
        return b"".join(messages)

    @property
    def newest_s(self) -> float:
        """When the newest message was complete, s."""
        return self._sent / self._rate_hz

    def skip(self, t_s: float) -> None:
        """Lose the messages up to `t_s`."""
        self._sent = max(self._sent, self._newest(t_s))

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the stream never waits
        """Return when the next message is complete."""
        return (self._sent + 1) / self._rate_hz

    def _newest(self, t_s: float) -> int:
        return math.floor(t_s * self._rate_hz + 1e-9)

    def _shown(self, index: NDArray[np.int64]) -> tuple[StreamField, ...]:
        """Return the fields, after the world was sampled for these messages."""
        sample = self._unit.sample(index / self._rate_hz)
        force = self._world.gravity(index / self._rate_hz)
        if self._unit.truth.accel_noise_g > 0:
            force = force + self._unit.truth.accel_noise_g * self._rng.standard_normal(force.shape)
        self._values: dict[str, NDArray[np.float64]] = {"temperature_c": sample.temperature_c[:, 0]}
        for column, axis in enumerate(self._axes):
            self._values[f"gyro_{axis}"] = sample.rate_dps[:, column]
            self._values[f"temperature_{axis}_c"] = sample.temperature_c[:, column]
        for column, body_axis in enumerate("xyz"):
            self._values[f"accel_{body_axis}_g"] = force[:, column]
        self._values["supply_v"] = sample.supply_v
        return self._format.fields

    def _numbers(self, field: StreamField, index: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the whole numbers, (n,), of a field."""
        counter = self._format.counter
        if counter is not None and counter.field == field.name:
            return index * counter.step % counter.wrap
        if (stamp := stamp_ticks(self._format)) is not None and stamp.field == field.name:
            ticks = np.rint(index / (self._rate_hz * stamp.tick_s)).astype(np.int64)
            return ticks if stamp.wrap is None else ticks % stamp.wrap
        if field.unit is not None and field.name in self._values:
            scale = scale_of(field, self._nominal_hz)
            return np.rint((self._values[field.name] - scale.offset) / scale.scale).astype(np.int64)
        return np.full(len(index), field.equals or field.all_set or 0, dtype=np.int64)
