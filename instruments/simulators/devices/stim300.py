"""A simulated STIM300: one datagram per sampling interval from power-on, whether or not the port is read.

It answers the commands C, I, T and R of the normal mode, and may be set otherwise than its bench file says: keys
`device` of its table in [simulation.units].
"""

from __future__ import annotations

import zlib
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from instruments.bench_config import GyroSettings, Strict, part_of
from instruments.protocols.stim300.datagrams import (
    ASK_BIAS_TRIM,
    ASK_CONFIGURATION,
    ASK_SERIAL_NUMBER,
    RESET,
    SAMPLE_RATES_HZ,
    SERIAL_PATTERN,
    Configuration,
    OutputUnit,
    bias_trim_frame,
    configuration_frame,
    content_of_datagram,
    serial_number_frame,
)
from instruments.protocols.stim300.frames import (
    ANGLE_PER_LSB,
    AXES,
    COUNTS_PER_S,
    OVERLOAD,
    RATE_PER_LSB,
    SATURATION_DPS,
    START_UP,
    TEMPERATURE_PER_LSB,
    layout_of,
)
from instruments.protocols.stim300.layouts import Bytes, Layout
from instruments.protocols.stim300.settings import Stim300Settings
from instruments.simulators.setup import InstrumentSetup

LATENCY_US = 506
FIRMWARE, REVISION = 12, "K"
#: Nothing is sent for this long after a reset, and readings are not valid for as long again as the second, s.
SILENT_AFTER_RESET_S, STARTS_UP_S = 0.2, 0.5
INTEGRATED_WRAP_DEG = 8.0
LONGEST_COMMAND = 32


class DeviceSettings(Strict):
    """How the simulated unit is set, where its bench file says otherwise."""

    datagram: int | None = None
    crlf: bool | None = None
    sample_rate_hz: Literal[125, 250, 500, 1000, 2000] | None = None
    output_unit: OutputUnit = "rate"
    filter_hz: Literal[16, 33, 66, 131, 262] = 262  #: what it says; its readings do not change with it
    g_compensation: str = "off"
    bias_trim_dps: tuple[float, float, float] | None = (0.0, 0.0, 0.0)  #: None: older firmware, which has none
    serial: str | None = None  #: N and 14 digits
    mute: bool = False  #: no wire leads to its receiver: it answers nothing


def _settings_of(setup: InstrumentSetup) -> DeviceSettings:
    simulation = setup.bench.simulation
    document = simulation.units.get(setup.gyro_name, {}).get("device", {}) if simulation else {}
    try:
        return DeviceSettings.model_validate(document)
    except ValidationError as error:
        wrong = error.errors()[0]
        where = ".".join(str(part) for part in wrong["loc"])
        raise ValueError(f"simulated STIM300 {setup.gyro_name}: device.{where}: {wrong['msg']}") from error


def _serial_of(gyro: GyroSettings) -> str:
    """Return the serial number of the bench file where it is one of a STIM300, else one that is made from it."""
    number = SERIAL_PATTERN.fullmatch(gyro.serial)
    return "N" + (number[1] if number else f"{zlib.crc32(gyro.serial.encode()):014d}")


def _constant_part(layout: Layout) -> Bytes:
    """Return a datagram, (stride,), with what is the same in each: identifier, latency and line end; the rest is 0."""
    frame = np.zeros(layout.stride, dtype=np.uint8)
    frame[0] = layout.id
    frame[layout.counter + 1 : layout.counter + 3] = np.array([LATENCY_US], dtype=">u2").view(np.uint8)
    if layout.crlf:
        frame[layout.length :] = (0x0D, 0x0A)
    return frame


class SimulatedStim300:
    """Encodes the world's unit; frames that do not fit into the port's buffer are lost."""

    def __init__(self, setup: InstrumentSetup) -> None:
        device = _settings_of(setup)
        options = part_of(setup.gyro, Stim300Settings).options
        chosen = {"datagram": device.datagram, "crlf": device.crlf}
        options = options.model_copy(update={name: value for name, value in chosen.items() if value is not None})
        self._layout = layout_of(options)
        self._constant = _constant_part(self._layout)
        self._unit, self._faults = setup.unit, setup.faults
        self._columns = [AXES.index(axis) for axis in setup.gyro.axes]
        self._rate_hz = float(device.sample_rate_hz or self._unit.sample_rate_hz)
        nominal_hz = device.sample_rate_hz or setup.gyro.sample_rate_hz or self._rate_hz
        self._step = round(COUNTS_PER_S / nominal_hz)  # by the clock of the unit, which may be fast or slow
        self._device = device
        self._angle_deg = np.zeros(3)
        self._sent = 0  #: index of the newest frame sent
        self._max_frames = setup.port_buffer_bytes // self._layout.stride + 1
        self._command = b""
        self._replies: dict[int, bytes] = {}  #: index of the frame that it replaces -> datagram
        self._silent_until = self._starts_until = 0  #: indices of frames, after a reset
        content, has_pps = content_of_datagram(options.datagram)
        set_hz = round(COUNTS_PER_S / self._step)
        configuration = Configuration(
            REVISION, FIRMWARE, set_hz if set_hz in SAMPLE_RATES_HZ else None, content, options.crlf,
            options.baudrate, options.stop_bits, options.parity, "xyz", device.output_unit, False, has_pps, 10,
            (str(device.filter_hz),) * 3, device.g_compensation,
        )  # fmt: skip
        self._says = {
            ASK_CONFIGURATION: configuration_frame(configuration),
            ASK_SERIAL_NUMBER: serial_number_frame(device.serial or _serial_of(setup.gyro), crlf=options.crlf),
        }
        if device.bias_trim_dps is not None:
            self._says[ASK_BIAS_TRIM] = bias_trim_frame(device.bias_trim_dps, crlf=options.crlf)

    def receive(self, data: bytes, t_s: float) -> None:
        """Take the commands of the normal mode; one that is not known has no reply."""
        *commands, rest = (self._command + data).split(b"\r")
        self._command = rest[-LONGEST_COMMAND:]
        if self._device.mute:
            return
        for command in commands:
            self._execute(command + b"\r", int(np.floor(t_s * self._rate_hz + 1e-9)) + 1)

    def _execute(self, command: bytes, index: int) -> None:
        """Execute a command that arrived before the frame of an index was sent."""
        if command == RESET:
            index = self._silent_until = index + round(SILENT_AFTER_RESET_S * self._rate_hz)
            self._starts_until = index + round(STARTS_UP_S * self._rate_hz)
        requests = [ASK_SERIAL_NUMBER, ASK_CONFIGURATION] if command == RESET else [command]
        for question in requests:
            if question in self._says:
                while index in self._replies:
                    index += 1
                self._replies[index] = self._says[question]

    def transmit(self, t_s: float) -> bytes:
        """Return the frames up to `t_s`."""
        newest = int(np.floor(t_s * self._rate_hz + 1e-9))
        if newest <= self._sent:
            return b""
        first = max(self._sent + 1, newest - self._max_frames + 1, self._silent_until)
        index = np.arange(first, newest + 1)
        self._sent = newest
        if not len(index):
            return b""
        frames = self._encode(index, t_s)
        return self._with_replies(index, frames) if self._replies else frames.tobytes()

    def skip(self, t_s: float) -> None:
        """Drop the frames up to `t_s`."""
        self._sent = max(self._sent, int(np.floor(t_s * self._rate_hz + 1e-9)))

    @property
    def newest_s(self) -> float:
        """When the newest frame was complete, s."""
        return self._sent / self._rate_hz

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the stream never waits
        """Return when the next frame is complete."""
        return max(self._sent + 1, self._silent_until) / self._rate_hz

    def _with_replies(self, index: NDArray[np.int64], frames: Bytes) -> bytes:
        """Return the frames, (n, stride) or some fewer of them, with each reply in place of one."""
        index = index[len(index) - len(frames) :]
        both = zip(index.tolist(), frames, strict=True)
        parts = [self._replies[number] if number in self._replies else frame.tobytes() for number, frame in both]
        self._replies = {number: reply for number, reply in self._replies.items() if number > self._sent}
        return b"".join(parts)

    def _words(self, rates_dps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the numbers (n, 3) that stand for rates (n, 3) in the output unit."""
        clipped = np.clip(rates_dps, -SATURATION_DPS, SATURATION_DPS)
        if self._device.output_unit in ("rate", "average"):
            return np.rint(clipped / RATE_PER_LSB)
        steps_deg = clipped / self._rate_hz
        if self._device.output_unit == "integrated":
            steps_deg = self._angle_deg + np.cumsum(steps_deg, axis=0)
            self._angle_deg = steps_deg[-1]
            half = INTEGRATED_WRAP_DEG / 2
            steps_deg = (steps_deg + half) % INTEGRATED_WRAP_DEG - half
        return np.rint(steps_deg / ANGLE_PER_LSB)

    def _on_three_axes(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return values of the unit's axes, (n, axes), as those of x, y and z, (n, 3), with 0 for one that it lacks."""
        if self._columns == [0, 1, 2]:
            return values
        by_axis = np.zeros((len(values), 3))
        by_axis[:, self._columns] = values
        return by_axis

    def _encode(self, index: NDArray[np.int64], t_s: float) -> Bytes:
        layout, n = self._layout, len(index)
        sample = self._unit.sample(index / self._rate_hz)
        frames = np.empty((n, layout.stride), dtype=np.uint8)
        frames[:] = self._constant
        rates, temperature_c = self._on_three_axes(sample.rate_dps), self._on_three_axes(sample.temperature_c)
        over = np.abs(rates) > SATURATION_DPS
        words = self._words(rates).astype(">i4")
        frames[:, 1:10] = words.view(np.uint8).reshape(n, 3, 4)[:, :, 1:].reshape(n, 9)
        if over.any():
            frames[:, layout.status] = np.where(over.any(axis=1), OVERLOAD, 0) | (over @ np.array([1, 2, 4]))
        if self._starts_until:
            frames[index < self._starts_until, layout.status] |= START_UP
        if layout.temperature is not None:
            codes = np.rint(temperature_c / TEMPERATURE_PER_LSB).astype(">i2")
            frames[:, layout.temperature : layout.temperature + 6] = codes.view(np.uint8).reshape(n, 6)
        skip = 0
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            skip = gap.value
        frames[:, layout.counter] = (index * self._step) % 256
        frames[:, layout.covered : layout.length] = layout.crc(frames).astype(">u4").view(np.uint8).reshape(n, 4)
        if self._faults.trigger(["wrong_crc"], t_s) is not None:
            frames[0, layout.covered] ^= 0x55
        return frames[skip:]
