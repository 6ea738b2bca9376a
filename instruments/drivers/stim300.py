"""Sensonor STIM300: a stream of binary datagrams with status, counter and CRC over RS-422."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import serial
from numpy.typing import NDArray

from instruments.bench_config import GyroSettings, Strict
from instruments.clock import Clock, sleep_until
from instruments.errors import LinkError, NoReply
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.stim300_frames import LAYOUTS, Layout, int16, int24, scan
from instruments.transport.factory import Ports
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime
from instruments.transport.serial import BROKEN

AXES = ("x", "y", "z")
RATE_PER_LSB = 2.0**-14
TEMPERATURE_PER_LSB = 2.0**-8
COUNTS_PER_S = 2000  #: the counter runs at the internal rate
#: Status bits that make a reading bad: integrity, start-up, outside conditions, overload, channel error.
BAD_STATUS = 0xF8
#: The output saturates here; what stands at the rail is no measurement (data sheet, table 5-3).
SATURATION_DPS = 480.0
SILENCE_S = 2.0
#: A port may keep no more than this; it is emptied when half of it can have come, and at least every second.
PORT_KEEPS_BYTES = 4096
EMPTY_EVERY_S = 1.0
START_WITHIN_S = 1.5


class Options(Strict):
    """What the unit was set up to send."""

    datagram: Literal[0x90, 0x94, 0xA7] = 0x94
    crlf: bool = False
    baudrate: int = 460_800


class Stim300:
    """Driver of a STIM300 in normal mode."""

    def __init__(self, settings: GyroSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.options = Options.model_validate(settings.options)
        self.layout: Layout = replace(LAYOUTS[self.options.datagram], crlf=self.options.crlf)
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz = settings.sample_rate_hz or 125.0
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        half_full_s = 0.5 * PORT_KEEPS_BYTES / (self.layout.stride * self.sample_rate_hz)
        self._empty_every_s = min(EMPTY_EVERY_S, half_full_s)
        self._ports, self._clock = ports, clock
        self._port: serial.SerialBase | None = None
        self._rest = b""
        self._counter: int | None = None
        self._time: StreamTime | None = None
        self._last_frame_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a datagram holds: rates, temperatures where it has them, and the status byte."""
        rates = [Channel(f"gyro_{axis}", "deg/s", RATE_PER_LSB) for axis in self.axes]
        warm = [Channel(f"temperature_{axis}_c", "deg C", TEMPERATURE_PER_LSB) for axis in self.axes]
        return (*rates, *(warm if self.layout.temperature is not None else ()), Channel("status", "", 1.0))

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, once an intact datagram has shown that it speaks."""
        was_open = self._port is not None
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        settings = self.settings
        return GyroIdentity(
            settings.serial, settings.model or "Sensonor STIM300", settings.technology or "mems", settings.datasheet
        )

    def start(self) -> None:
        """Control the stream: open the port and drop what is stale."""
        if self._port is None:
            self._port = self._ports.serial(
                self.settings.port or "", device=self.name, baudrate=self.options.baudrate, timeout_s=SILENCE_S
            )
        self._time = None
        self._drop()
        self._last_frame_s = self._clock.now_s()

    def _drop(self) -> None:
        try:
            self._opened().reset_input_buffer()
        except BROKEN as error:
            self._lose(error)
        self._rest, self._counter = b"", None
        if self._time is not None:
            self._time.drop()

    def _opened(self) -> serial.SerialBase:
        if self._port is None:
            raise LinkError(self.name, f"the stream on {self.settings.port} was not started")
        return self._port

    def _lose(self, error: Exception) -> None:
        self.stop()
        raise LinkError(
            self.name,
            f"the link {self.settings.port} broke ({error}); check the cable; the stream must be started again",
        ) from error

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where the stream has gaps."""
        end_s = self._clock.now_s() + duration_s
        data = b""
        while True:
            sleep_until(self._clock, min(self._clock.now_s() + self._empty_every_s, end_s))
            data += self._take()
            if self._clock.now_s() >= end_s - 1e-9:
                break
        readings = self._decode(data)
        now = self._clock.now_s()
        if len(readings):
            self._last_frame_s = now
        elif now - self._last_frame_s > SILENCE_S:
            raise NoReply(
                self.name,
                f"no intact datagram on {self.settings.port} for {now - self._last_frame_s:.1f} s; check power, cable, "
                f"bit rate {self.options.baudrate} and datagram 0x{self.options.datagram:02X}",
            )
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older."""
        self._drop()
        deadline = self._clock.now_s() + START_WITHIN_S
        while self._clock.now_s() < deadline:
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            data = self._take()
            if data and len(found := self._decode(data)):
                self._last_frame_s = self._clock.now_s()
                newest = slice(len(found) - 1, len(found))
                return Readings(
                    found.t_s[newest], {name: raw[newest] for name, raw in found.raw.items()}, found.valid[newest]
                )
        raise NoReply(
            self.name,
            f"no intact datagram on {self.settings.port} within {START_WITHIN_S:g} s; check power, cable, "
            f"bit rate {self.options.baudrate} and datagram 0x{self.options.datagram:02X}",
        )

    def stop(self) -> None:
        """Control the stream: close the port; safe to call twice."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _take(self) -> bytes:
        port = self._opened()
        try:
            waiting = port.in_waiting
            return bytes(port.read(waiting)) if waiting else b""
        except BROKEN as error:
            self._lose(error)
            raise

    def _decode(self, data: bytes) -> Readings:
        found = scan(self._rest + data, self.layout)
        self._rest = found.rest
        frames, layout = found.frames, self.layout
        if len(frames) == 0:
            return Readings(
                np.zeros(0), {c.name: np.zeros(0, dtype=np.int64) for c in self.channels}, np.zeros(0, bool)
            )
        rates = int24(frames, 1).astype(np.int64)
        status = frames[:, layout.status].astype(np.int64)
        valid = (status & BAD_STATUS) == 0
        valid &= np.all(np.abs(rates) < SATURATION_DPS / RATE_PER_LSB, axis=1)
        raw: dict[str, NDArray[np.int64]] = {f"gyro_{axis}": rates[:, AXES.index(axis)] for axis in self.axes}
        if layout.temperature is not None and layout.temperature_status is not None:
            warm = int16(frames, layout.temperature).astype(np.int64)
            raw |= {f"temperature_{axis}_c": warm[:, AXES.index(axis)] for axis in self.axes}
            valid &= (frames[:, layout.temperature_status] & BAD_STATUS) == 0
        raw["status"] = status
        times, lost = self._times(frames[:, layout.counter].astype(np.int64))
        return Readings(times, raw, valid, lost, found.damaged)

    def _times(self, counter: NDArray[np.int64]) -> tuple[NDArray[np.float64], int]:
        """Return the frames' times (n,), and how many frames are missing by the counter and by the Clock."""
        step = round(COUNTS_PER_S / self.sample_rate_hz)
        wrap = 256 // step if 256 % step == 0 else 256
        before = counter[0] - step if self._counter is None else self._counter
        advance = (np.diff(counter, prepend=before) % 256) // step
        advance[advance == 0] = wrap
        self._counter = int(counter[-1])
        if self._time is None:
            self._time = StreamTime(1.0 / self.sample_rate_hz, self._clock.now_s())
        times, unseen = self._time.times(advance, self._clock.now_s(), wrap)
        return times, int(advance.sum() - len(advance)) + unseen
