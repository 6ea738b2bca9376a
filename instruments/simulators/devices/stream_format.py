"""A simulated gyro that sends the messages of any stream format, whether or not the port is read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import part_of
from instruments.protocols.stream_formats.document import StreamField
from instruments.protocols.stream_formats.encoding import message
from instruments.protocols.stream_formats.readings import pulse_ticks, scale_of, stamp_ticks
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.simulators.sampled_unit import SampledUnit
from instruments.simulators.setup import InstrumentSetup

#: Bytes of the shortest message: a port holds no more than its buffer.
SHORT_MESSAGE_BYTES = 12


class SimulatedStream(SampledUnit):
    """Sends a message per sampling interval of the world's unit."""

    def __init__(self, setup: InstrumentSetup) -> None:
        settings = part_of(setup.gyro, StreamSettings)
        super().__init__(setup, tuple(settings.axes), setup.port_buffer_bytes // SHORT_MESSAGE_BYTES)
        self._format = settings.format
        self._nominal_hz = settings.sample_rate_hz or self._rate_hz

    def transmit(self, t_s: float) -> bytes:
        """Return the messages up to `t_s`."""
        index = self._due(t_s)
        if not len(index):
            return b""
        values = self._values(index)
        columns = [(field.name, self._numbers(field, index, values)) for field in self._format.fields]
        rows = zip(*(numbers.tolist() for _, numbers in columns), strict=True)
        names = [name for name, _ in columns]
        messages = [message(self._format, dict(zip(names, row, strict=True))) for row in rows]
        if self._faults.trigger(["wrong_crc"], t_s) is not None:
            messages[0] = messages[0][:-3] + bytes([messages[0][-3] ^ 0x55]) + messages[0][-2:]
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            messages = messages[gap.value :]
        return b"".join(messages)

    def _numbers(
        self, field: StreamField, index: NDArray[np.int64], values: dict[str, NDArray[np.float64]]
    ) -> NDArray[np.int64]:
        """Return the whole numbers, (n,), of a field."""
        counter = self._format.counter
        if counter is not None and counter.field == field.name:
            return index * counter.step % counter.wrap
        if (stamp := stamp_ticks(self._format)) is not None and stamp.field == field.name:
            ticks = np.rint(index / (self._rate_hz * stamp.tick_s)).astype(np.int64)
            return ticks if stamp.wrap is None else ticks % stamp.wrap
        if (pulses := pulse_ticks(self._format)) is not None and pulses.field == field.name:
            of_pulse, since_s = np.divmod(index / self._rate_hz, pulses.interval_s)
            return (np.rint(since_s / pulses.tick_s) if pulses.tick_s else of_pulse).astype(np.int64)
        if field.unit is not None and field.name in values:
            scale = scale_of(field, self._nominal_hz)
            return np.rint((values[field.name] - scale.offset) / scale.scale).astype(np.int64)
        return np.full(len(index), field.equals or field.all_set or 0, dtype=np.int64)
