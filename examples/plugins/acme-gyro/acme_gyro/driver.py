"""Driver of the Acme G1."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from acme_gyro.protocol import C_PER_COUNT, COUNTER_WRAP, DPS_PER_COUNT, decode
from instruments.bench_config import GyroSettings
from instruments.clock import Clock
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import NoReply
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.transport.factory import Ports
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime
from instruments.transport.serial_stream import SerialStream

SILENCE_S = 2.0


class G1Settings(GyroSettings):
    """Keys of an Acme G1 in a bench file."""

    port: str
    sample_rate_hz: float = Field(default=20.0, gt=0)
    baudrate: int = Field(default=115_200, gt=0)
    mirrored: bool = False  #: mounted upside down


class G1:
    """A gyro that sends a line per reading."""

    def __init__(self, settings: G1Settings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.axes: tuple[str, ...] = settings.axes
        self.sample_rate_hz: float = settings.sample_rate_hz
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        sign = -1 if settings.mirrored else 1
        rate = Channel(f"gyro_{settings.axes[0]}", "deg/s", sign * DPS_PER_COUNT)
        self.channels: tuple[Channel, ...] = (rate, Channel("temperature_c", "deg C", C_PER_COUNT))
        self._clock = clock
        self._stream = SerialStream(
            self.name, settings.port, ports, clock, baudrate=settings.baudrate, timeout_s=SILENCE_S
        )
        self._time = StreamTime(1 / self.sample_rate_hz, 0.0)
        self._unfinished = b""
        self._in_step = False  #: a whole line begins at `_unfinished`
        self._counter: int | None = None
        self._last_line_s = 0.0

    def identify(self) -> GyroIdentity:
        """Get the identity from the bench file, after one intact line; raises NoReply, LinkError."""
        was_open = self._stream.is_open
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        given = self.settings
        return GyroIdentity(given.serial, given.model or "Acme G1", given.technology or "mems", given.datasheet)

    def start(self) -> None:
        """Control the stream: open it and drop what is old; raises LinkError."""
        self._stream.open()
        self._time = StreamTime(1 / self.sample_rate_hz, self._clock.now_s())
        self._discard()
        self._last_line_s = self._clock.now_s()

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; raises NoReply after 2 s without a line, LinkError."""
        readings = self._decode(self._stream.read_for(duration_s, every_s=1.0))
        if self._clock.now_s() - self._last_line_s > SILENCE_S:
            raise self._silent()
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply, LinkError."""
        self._discard()
        deadline_s = self._clock.now_s() + SILENCE_S
        while self._clock.now_s() < deadline_s:
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            if len(readings := self._decode(self._stream.read_available())):
                return readings.newest()
        raise self._silent()

    def stop(self) -> None:
        """Control the stream: close the port; safe to call twice."""
        self._stream.close()

    def _silent(self) -> NoReply:
        port, baudrate = self.settings.port, self.settings.baudrate
        return NoReply(
            self.name, f"no intact line on {port} for {SILENCE_S:g} s; check power, cable, baud rate {baudrate}"
        )

    def _discard(self) -> None:
        self._stream.discard_input()
        self._unfinished, self._in_step, self._counter = b"", False, None
        self._time.drop()

    def _decode(self, data: bytes) -> Readings:
        *lines, self._unfinished = (self._unfinished + data).split(b"\n")
        if lines and not self._in_step:
            del lines[0]  # its beginning was dropped
            self._in_step = True
        decoded = [decode(line) for line in lines]
        good = np.array([each for each in decoded if each is not None], dtype=np.int64).reshape(-1, 3)
        damaged = len(decoded) - len(good)
        raw = {channel.name: good[:, column] for column, channel in enumerate(self.channels, start=1)}
        if len(good) == 0:
            return Readings(np.zeros(0), raw, np.zeros(0, dtype=bool), 0, damaged)
        now_s = self._last_line_s = self._clock.now_s()
        before = good[0, 0] - 1 if self._counter is None else self._counter
        advance = np.diff(good[:, 0], prepend=before) % COUNTER_WRAP
        advance[advance == 0] = COUNTER_WRAP
        self._counter = int(good[-1, 0])
        times, uncounted = self._time.times(advance, now_s, COUNTER_WRAP)
        lost = int(advance.sum()) - len(good) + uncounted
        return Readings(times, raw, np.ones(len(good), dtype=bool), lost, damaged)


DRIVER = GyroDriver(G1Settings, G1, Trial(section={"port": "sim://acme-g1"}, unit={"profile": "rd2100"}))
