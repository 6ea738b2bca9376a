"""A simulated STIM300: one datagram per sampling interval from power-on, whether or not the port is read."""

from __future__ import annotations

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.stim300_frames import (
    AXES,
    COUNTS_PER_S,
    OVERLOAD,
    RATE_PER_LSB,
    SATURATION_DPS,
    TEMPERATURE_PER_LSB,
    Bytes,
    Stim300Settings,
    layout_of,
)
from instruments.simulators.setup import InstrumentSetup

LATENCY_US = 506


class SimulatedStim300:
    """Encodes the world's unit; frames that do not fit into the port's buffer are lost."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self._layout = layout_of(part_of(setup.gyro, Stim300Settings).options)
        self._unit, self._faults = setup.unit, setup.faults
        self._columns = [AXES.index(axis) for axis in setup.gyro.axes]
        self._rate_hz = self._unit.sample_rate_hz
        self._step = round(COUNTS_PER_S / self._rate_hz)
        self._sent = 0  #: index of the newest frame sent
        self._max_frames = setup.port_buffer_bytes // self._layout.stride + 1

    def receive(self, data: bytes, t_s: float) -> None:
        """Normal mode answers no command that the driver uses."""

    def transmit(self, t_s: float) -> bytes:
        """Return the frames up to `t_s`."""
        newest = int(np.floor(t_s * self._rate_hz + 1e-9))
        if newest <= self._sent:
            return b""
        first = max(self._sent + 1, newest - self._max_frames + 1)
        index = np.arange(first, newest + 1)
        self._sent = newest
        return self._encode(index, t_s).tobytes()

    @property
    def newest_s(self) -> float:
        """When the newest frame was complete, s."""
        return self._sent / self._rate_hz

    def skip(self, t_s: float) -> None:
        """Lose the frames up to `t_s`."""
        self._sent = max(self._sent, int(np.floor(t_s * self._rate_hz + 1e-9)))

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the stream never waits
        """Return when the next frame is complete."""
        return (self._sent + 1) / self._rate_hz

    def _encode(self, index: np.ndarray, t_s: float) -> Bytes:
        layout, n = self._layout, len(index)
        sample = self._unit.sample(index / self._rate_hz)
        frames = np.zeros((n, layout.stride), dtype=np.uint8)
        frames[:, 0] = layout.id
        rates = np.zeros((n, 3))
        warm = np.zeros((n, 3))
        rates[:, self._columns], warm[:, self._columns] = sample.rate_dps, sample.temperature_c
        over = np.abs(rates) > SATURATION_DPS
        words = np.rint(np.clip(rates, -SATURATION_DPS, SATURATION_DPS) / RATE_PER_LSB).astype(">i4")
        frames[:, 1:10] = words.view(np.uint8).reshape(n, 3, 4)[:, :, 1:].reshape(n, 9)
        frames[:, layout.status] = np.where(over.any(axis=1), OVERLOAD, 0) | (over @ np.array([1, 2, 4]))
        if layout.temperature is not None:
            codes = np.rint(warm / TEMPERATURE_PER_LSB).astype(">i2")
            frames[:, layout.temperature : layout.temperature + 6] = codes.view(np.uint8).reshape(n, 6)
        skip = 0
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            skip = gap.value
        frames[:, layout.counter] = (index * self._step) % 256
        frames[:, layout.counter + 1 : layout.counter + 3] = np.array([LATENCY_US], dtype=">u2").view(np.uint8)
        frames[:, layout.covered : layout.length] = layout.crc(frames).astype(">u4").view(np.uint8).reshape(n, 4)
        if layout.crlf:
            frames[:, layout.length :] = (0x0D, 0x0A)
        if self._faults.trigger(["wrong_crc"], t_s) is not None:
            frames[0, layout.covered] ^= 0x55
        return frames[skip:]
