"""KVH fibre-optic gyros that send a line of text per reading: DSP-3000, and E-Core RD2100 as another line format."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
import serial

from instruments.bench_config import GyroSettings, Strict
from instruments.clock import Clock, sleep_until
from instruments.errors import LimitError, LinkError, NoReply
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.transport.factory import Ports
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime
from instruments.transport.serial import BROKEN

SILENCE_S = 2.0
EMPTY_EVERY_S = 1.0
MICRO = 1e-6
MILLI = 1e-3
LONGEST_LINE = 80


@dataclass(frozen=True)
class LineFormat:
    """How a line is read: `rate` in deg/s, and perhaps `flag` (1: valid) and `temperature` in deg C."""

    pattern: str
    baudrate: int
    rate_hz: float
    sign: Literal[1, -1]  #: -1 where the device counts clockwise positive
    limit_dps: float  #: beyond it the line is not to be trusted, whatever its flag says
    length: int | None = None  #: of a line without its line end
    start_command: str = ""


#: DSP-3000 manual, pages 7 and 13: 38400 baud, 19 characters, clockwise positive, linear to 375 deg/s.
DSP3000 = LineFormat(r"\s*(?P<rate>-?\d+\.\d{6})\s+(?P<flag>[01])", 38_400, 100.0, -1, 375.0, 19, "R")
#: The E-Core's line is not public: one decimal number and, as we assume, the temperature behind it.
RD2100 = LineFormat(r"\s*(?P<rate>-?\d+\.\d+)(?:\s+(?P<temperature>-?\d+\.\d+))?\s*", 9_600, 10.0, 1, 150.0)


class Options(Strict):
    """What differs from the usual line, from the unit's manual."""

    pattern: str | None = None
    baudrate: int | None = None
    sign: Literal[1, -1] | None = None
    limit_dps: float | None = None


class KvhLines:
    """Driver of a gyro that sends lines. Raw rates are whole microdegrees per second: the digits as they were sent."""

    format: LineFormat
    model: str
    has_temperature: bool

    def __init__(self, settings: GyroSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        options = Options.model_validate(settings.options)
        form = self.format
        self._baudrate = options.baudrate or form.baudrate
        self._sign = options.sign or form.sign
        self._limit_dps = options.limit_dps or form.limit_dps
        try:
            self._pattern = re.compile(options.pattern or form.pattern)
        except re.error as error:
            raise LimitError(
                self.name, f"option pattern {options.pattern!r} is no regular expression ({error})"
            ) from error
        self._length = form.length if options.pattern is None else None
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz = settings.sample_rate_hz or form.rate_hz
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._ports, self._clock = ports, clock
        self._port: serial.SerialBase | None = None
        self._rest = b""
        self._in_line = False
        self._time: StreamTime | None = None
        self._last_line_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a line holds."""
        rate = Channel(f"gyro_{self.axes[0]}", "deg/s", self._sign * MICRO)
        return (rate, Channel("temperature_c", "deg C", MILLI)) if self.has_temperature else (rate,)

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, once a line has shown that it speaks."""
        was_open = self._port is not None
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        settings = self.settings
        return GyroIdentity(
            settings.serial, settings.model or self.model, settings.technology or "fog", settings.datasheet
        )

    def start(self) -> None:
        """Control the stream: open the port, ask for rates, and drop what is stale or partial."""
        if self._port is None:
            self._port = self._ports.serial(
                self.settings.port or "", device=self.name, baudrate=self._baudrate, timeout_s=SILENCE_S
            )
        try:
            if self.format.start_command:
                self._port.write(self.format.start_command.encode() * 3)  # there is no read-back: sent three times
        except BROKEN as error:
            self._lose(error)
        self._time = None
        self._drop()
        self._last_line_s = self._clock.now_s()

    def _drop(self) -> None:
        try:
            self._opened().reset_input_buffer()
        except BROKEN as error:
            self._lose(error)
        self._rest, self._in_line = b"", False
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
        """Get every reading of the next `duration_s` seconds; fewer where lines are missing."""
        end_s = self._clock.now_s() + duration_s
        data = b""
        while True:
            sleep_until(self._clock, min(self._clock.now_s() + EMPTY_EVERY_S, end_s))
            data += self._take()
            if self._clock.now_s() >= end_s - 1e-9:
                break
        readings = self._decode(data)
        now = self._clock.now_s()
        if len(readings):
            self._last_line_s = now
        elif now - self._last_line_s > max(SILENCE_S, 5 / self.sample_rate_hz):
            raise self._silent(now - self._last_line_s)
        return readings

    def _silent(self, silence_s: float) -> NoReply:
        return NoReply(
            self.name,
            f"no whole line on {self.settings.port} for {silence_s:.1f} s; check power, cable and baud rate "
            f"{self._baudrate}",
        )

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older."""
        self._drop()
        deadline = self._clock.now_s() + SILENCE_S
        while self._clock.now_s() < deadline:
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            data = self._take()
            if data and len(found := self._decode(data)):
                self._last_line_s = self._clock.now_s()
                newest = slice(len(found) - 1, len(found))
                return Readings(
                    found.t_s[newest], {name: raw[newest] for name, raw in found.raw.items()}, found.valid[newest]
                )
        raise self._silent(SILENCE_S)

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
        pieces = (self._rest + data).split(b"\n")
        self._rest = pieces.pop()[-LONGEST_LINE:]
        if pieces and not self._in_line:
            pieces.pop(0)  # the first line after opening is usually cut
            self._in_line = True
        rows, valid, damaged = [], [], 0
        for piece in pieces:
            row = self._parse(piece.rstrip(b"\r").decode("latin-1"))
            if row is None:
                damaged += 1
            else:
                rows.append(row[0])
                valid.append(row[1])
        codes = np.asarray(rows, dtype=np.int64).reshape(len(rows), len(self.channels))
        raw = {channel.name: codes[:, i] for i, channel in enumerate(self.channels)}
        if not rows:
            return Readings(np.zeros(0), raw, np.zeros(0, dtype=bool), 0, damaged)
        if self._time is None:
            self._time = StreamTime(1.0 / self.sample_rate_hz, self._clock.now_s())
        advance = np.ones(len(rows), dtype=np.int64)
        advance[0] += damaged  # a line that could not be read has taken its time too
        times, lost = self._time.times(advance, self._clock.now_s())
        return Readings(times, raw, np.asarray(valid), lost, damaged)

    def _parse(self, line: str) -> tuple[list[int], bool] | None:
        if self._length is not None and len(line) != self._length:
            return None
        match = self._pattern.fullmatch(line)
        if match is None:
            return None
        fields = match.groupdict()
        rate = round(float(fields["rate"]) / MICRO)
        valid = fields.get("flag", "1") != "0" and abs(rate) <= self._limit_dps / MICRO
        if not self.has_temperature:
            return [rate], valid
        warm = fields.get("temperature")
        return ([rate, round(float(warm) / MILLI)], valid) if warm is not None else None


class KvhDsp3000(KvhLines):
    """DSP-3000, 100 lines per second; its lines carry no temperature."""

    format, model, has_temperature = DSP3000, "KVH DSP-3000", False


class Rd2100(KvhLines):
    """E-Core RD2100, 10 lines per second."""

    format, model, has_temperature = RD2100, "KVH E-Core RD2100", True
