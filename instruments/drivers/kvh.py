"""KVH fibre-optic gyros DSP-3000 and E-Core RD2100: one driver for text lines, one line format per model."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial

import numpy as np

from instruments.clock import Clock
from instruments.drivers import probes
from instruments.drivers.driver import GyroDriver, Trial
from instruments.drivers.streamed_readings import identify_stream
from instruments.errors import LimitError, NoReply
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.interfaces.self_checks import StreamPeriod
from instruments.protocols.byte_lines import split_lines
from instruments.protocols.kvh_lines import (
    C_PER_COUNT,
    DPS_PER_COUNT,
    DSP3000,
    MAX_LINE_BYTES,
    RD2100,
    KvhSettings,
    Line,
    LineFormat,
    parse_line,
)
from instruments.transport.factory import Ports
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime, refuse_other_rate
from instruments.transport.serial_stream import SerialStream, line_of
from instruments.transport.undecided import Undecided

SILENCE_S = 2.0
EMPTY_EVERY_S = 1.0
#: The start command has no read-back: it is sent this often.
START_REPEATS = 3


@dataclass(frozen=True)
class Model:
    """One model of the family."""

    name: str
    format: LineFormat
    has_temperature: bool


KVH_DSP3000 = Model("KVH DSP-3000", DSP3000, has_temperature=False)
KVH_RD2100 = Model("KVH E-Core RD2100", RD2100, has_temperature=True)


class KvhGyro:
    """Driver of a gyro that sends lines. Raw rates are whole microdegrees per second: the digits of the line."""

    def __init__(self, settings: KvhSettings, ports: Ports, clock: Clock, *, model: Model) -> None:
        self.name = settings.name
        self.settings = settings
        self._model = model
        options = settings.options
        line = model.format
        self._baudrate = options.baudrate or line.baudrate
        self._sign = options.sign or line.sign
        self._limit_counts = (options.limit_dps or line.limit_dps) / DPS_PER_COUNT
        self._pattern = self._compile(options.pattern or line.pattern)
        self._length = line.length if options.pattern is None else None
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz = settings.sample_rate_hz or line.rate_hz
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._clock = clock
        self._stream = SerialStream(
            self.name, settings.port or "", ports, clock, baudrate=self._baudrate, timeout_s=SILENCE_S,
            line=line_of(options),
        )  # fmt: skip
        self._unfinished = b""
        self._in_line = False
        self._time = StreamTime(1.0 / self.sample_rate_hz, 0.0)
        self._undecided = Undecided()
        self._last_line_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a line holds: the rate in deg/s, and the temperature in deg C where the model sends it."""
        rate = Channel(f"gyro_{self.axes[0]}", "deg/s", self._sign * DPS_PER_COUNT)
        return (rate, Channel("temperature_c", "deg C", C_PER_COUNT)) if self._model.has_temperature else (rate,)

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after one line was read.

        Raises WrongInstrument where the port is on another USB adapter than the bench file names, NoReply, LinkError.
        """
        adapter, usual = self.settings.options.adapter, (self._model.name, "fog")
        return identify_stream(self, self.settings, self._stream, usual, adapter=adapter)

    def start(self) -> None:
        """Open the port, ask for rates, and drop stale or partial lines; raises LinkError."""
        self._stream.open()
        if command := self._model.format.start_command:
            self._stream.write(command.encode() * START_REPEATS)
        self._discard()
        self._last_line_s = self._clock.now_s()
        self._time = StreamTime(1.0 / self.sample_rate_hz, self._last_line_s)

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where lines are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a line, and LinkError.
        """
        readings = self._decode(self._stream.read_for(duration_s, EMPTY_EVERY_S))
        now_s = self._clock.now_s()
        if now_s - self._last_line_s > max(SILENCE_S, 5 / self.sample_rate_hz):
            raise self._no_line(now_s - self._last_line_s)
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        self._discard()
        deadline_s = self._clock.now_s() + SILENCE_S
        while self._clock.now_s() < deadline_s:
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            data = self._stream.read_available()
            if data and len(readings := self._decode(data)):
                return readings.newest()
        raise self._no_line(SILENCE_S)

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        self._stream.close()

    def kept_back(self) -> Readings | None:
        """Get the readings that are kept back because the stream is late, each once; None where none are."""
        return self._undecided.take()

    @property
    def period(self) -> StreamPeriod:
        """Get what is known of the period since the start."""
        return self._time.known

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock, so that readings may be lost."""
        return self._time.is_late

    @property
    def counter_step(self) -> None:
        """Get None: a line has no counter."""
        return

    def _compile(self, pattern: str) -> re.Pattern[str]:
        try:
            return re.compile(pattern)
        except re.error as error:
            raise LimitError(
                self.name,
                f"option pattern {pattern!r} is not a regular expression ({error}); correct it in the bench file",
            ) from error

    def _discard(self) -> None:
        self._stream.discard_input()
        self._unfinished, self._in_line = b"", False
        self._time.drop()
        self._undecided.drop()

    def _no_line(self, silence_s: float) -> NoReply:
        advice = self._stream.advice(f"baud rate {self._baudrate} and options.pattern")
        return NoReply(self.name, f"no complete line on {self.settings.port} for {silence_s:.1f} s: {advice}")

    def _decode(self, data: bytes) -> Readings:
        pieces, behind, self._unfinished = split_lines(self._unfinished + data, MAX_LINE_BYTES)
        if pieces and not self._in_line:
            pieces, behind = pieces[1:], behind[1:]  # the first line after opening is usually cut
            self._in_line = True
        lines = [self._parse(piece) if piece else None for piece in pieces]
        good = [line for line in lines if line is not None]
        damaged = sum(map(bool, pieces)) - len(good)
        codes = np.asarray([self._counts(line) for line in good], dtype=np.int64).reshape(-1, len(self.channels))
        raw = {channel.name: codes[:, i] for i, channel in enumerate(self.channels)}
        if not good:
            return Readings(np.zeros(0), raw, np.zeros(0, dtype=bool), 0, damaged, arrival_s=np.zeros(0))
        self._last_line_s, self._stream.unused = self._clock.now_s(), 0
        came = self._stream.last
        arrival_s = self._stream.arrival_s(behind[[line is not None for line in lines]])
        advance = np.ones(len(good), dtype=np.int64)
        advance[0] += damaged  # a damaged line has taken its sampling period too
        times, lost = self._time.times(advance, came.now_s, width_s=came.width_s, arrival_s=arrival_s)
        refuse_other_rate(self.name, self.settings.port, self._time.line)
        valid = np.asarray([line.flag and abs(line.rate) <= self._limit_counts for line in good])
        readings = Readings(times, raw, valid, lost, damaged, arrival_s=arrival_s)
        return self._undecided.pass_on(readings, self._time)

    def _parse(self, piece: bytes) -> Line | None:
        line = parse_line(piece.decode("latin-1"), self._pattern, self._length)
        return None if line is None or (self._model.has_temperature and line.temperature is None) else line

    def _counts(self, line: Line) -> list[int]:
        return [line.rate, line.temperature or 0] if self._model.has_temperature else [line.rate]


DSP3000_DRIVER = GyroDriver(
    KvhSettings,
    partial(KvhGyro, model=KVH_DSP3000),
    Trial(section={"driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "sample_rate_hz": 100}),
    probe=probes.DSP_3000,
)
RD2100_DRIVER = GyroDriver(KvhSettings, partial(KvhGyro, model=KVH_RD2100), probe=probes.RD_2100)
