"""Driver of any gyro whose stream a format describes: lines of numbers or binary frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import NoReply
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.stream_formats.frames import FrameDecoder
from instruments.protocols.stream_formats.lines import LineDecoder
from instruments.protocols.stream_formats.readings import Decoded, Decoder, StampTicks, scale_of, stamp_ticks
from instruments.protocols.stream_formats.settings import StreamSettings
from instruments.transport.adapters import require_adapter
from instruments.transport.device_time import DeviceTime
from instruments.transport.factory import Ports
from instruments.transport.sample_counter import SampleCounter
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime, refuse_other_rate
from instruments.transport.serial_stream import SerialStream, line_of

SILENCE_S = 2.0
#: Least size of a port's input buffer; a simulated port is emptied when half of it can be full.
PORT_BUFFER_BYTES, EMPTY_EVERY_S, LONG_MESSAGE_BYTES = 4096, 1.0, 160


class StreamFormatGyro:
    """A gyro that sends readings unasked. Raw values are the whole numbers of the format's fields."""

    def __init__(self, settings: StreamSettings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self._format = format_ = settings.format
        self._baudrate = settings.options.baudrate or format_.baudrate
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz: float = settings.sample_rate_hz or 0.0
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        self._decoder: Decoder = LineDecoder(format_) if format_.line is not None else FrameDecoder(format_)
        unused = {f"gyro_{axis}" for axis in format_.axes} - {f"gyro_{axis}" for axis in self.axes}
        self._fields = [each for each in format_.fields if each.unit is not None and each.name not in unused]
        half_full_s = 0.5 * PORT_BUFFER_BYTES / (LONG_MESSAGE_BYTES * self.sample_rate_hz)
        self._empty_every_s = min(EMPTY_EVERY_S, half_full_s)
        self._clock = clock
        self._stream = SerialStream(
            self.name, settings.port or "", ports, clock, baudrate=self._baudrate, timeout_s=SILENCE_S,
            line=line_of(settings.options),
        )  # fmt: skip
        self._counter = self._new_counter()
        self._stamp: int | None = None  #: time stamp of the newest reading
        self._time = StreamTime(1.0 / self.sample_rate_hz, 0.0)
        self._device_time = self._new_device_time()
        self._last_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a message holds: the fields with a unit, in deg/s, deg C and g."""
        scales = [(each.name, scale_of(each, self.sample_rate_hz)) for each in self._fields]
        return tuple(Channel(name, found.unit, found.scale, found.offset) for name, found in scales)

    def identify(self) -> GyroIdentity:
        """Get the unit's identity from the bench file, after one message was read.

        Raises WrongInstrument where the port is on another USB adapter than the bench file names, NoReply, LinkError.
        """
        settings = self.settings
        adapter = require_adapter(self.name, settings.port, settings.options.adapter)
        was_open = self._stream.is_open
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        return GyroIdentity(
            settings.serial, settings.model or self._format.name, settings.technology or "mems", settings.datasheet,
            reported=adapter,
        )  # fmt: skip

    def start(self) -> None:
        """Control the stream: open the port, send what the format sends at the start, drop what is old; LinkError."""
        self._stream.open()
        for text in self._format.start:
            self._stream.write(text.encode("latin-1"))
        self._counter = self._new_counter()
        self._device_time = self._new_device_time()
        self._discard()
        self._last_s = self._clock.now_s()
        self._time = StreamTime(1.0 / self.sample_rate_hz, self._last_s)

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where messages are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a reading; MalformedReply for a counter that
        stands; WrongInstrument for another rate; LinkError.
        """
        readings = self._decode(self._stream.read_for(duration_s, self._empty_every_s))
        now_s = self._clock.now_s()
        if len(readings):
            self._last_s, self._stream.unused = now_s, 0
        elif now_s - self._last_s > max(SILENCE_S, 5 / self.sample_rate_hz):
            raise self._no_reading(now_s - self._last_s)
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        self._discard()
        began_s = self._clock.now_s()
        while self._clock.now_s() < began_s + max(SILENCE_S, 5 / self.sample_rate_hz):
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            data = self._stream.read_available()
            if data and len(readings := self._decode(data)):
                self._last_s, self._stream.unused = self._clock.now_s(), 0
                return readings.newest()
        raise self._no_reading(self._clock.now_s() - began_s)

    def stop(self) -> None:
        """Control the stream: close the port; safe to call twice."""
        self._stream.close()

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock, so that readings may be lost."""
        return self._time.is_late

    def _new_counter(self) -> SampleCounter | None:
        given = self._format.counter
        if given is None:
            return None
        return SampleCounter(self.name, self.settings.port, step=given.step, wrap=given.wrap)

    def _new_device_time(self) -> DeviceTime | None:
        """Return the unit's own time: by its time stamps, or by its counter; None without either."""
        if (ticks := stamp_ticks(self._format)) is not None:
            return DeviceTime(ticks.tick_s, ticks.wrap)
        if (given := self._format.counter) is not None:
            return DeviceTime(1.0 / (self.sample_rate_hz * given.step), given.wrap)
        return None

    def _discard(self) -> None:
        self._stream.discard_input()
        self._decoder.drop()
        self._stamp = None
        if self._counter is not None:
            self._counter.drop()
        self._time.drop()

    def _no_reading(self, silence_s: float) -> NoReply:
        port, name = self.settings.port, self._format.name
        advice = self._stream.advice(f"baud rate {self._baudrate} and that the unit sends what the format says")
        return NoReply(self.name, f"no intact {name} reading on {port} for {silence_s:.1f} s: {advice}")

    def _decode(self, data: bytes) -> Readings:
        found = self._decoder.feed(data)
        damaged, kept = found.damaged, np.ones(len(found), dtype=bool)
        if self._counter is not None and self._format.counter is not None and len(found):
            content = np.stack(list(found.values.values()), axis=1)
            kept = self._counter.is_new(found.values[self._format.counter.field], content)
            damaged += len(kept) - int(kept.sum())
        raw = {each.name: found.values[each.name][kept] for each in self._fields}
        valid = found.valid[kept]
        if not len(valid):
            device_s = None if self._device_time is None else np.zeros(0)
            return Readings(np.zeros(0), raw, valid, 0, damaged, device_s, np.zeros(0))
        advance = self._advance(found, kept)
        came = self._stream.last
        turn = 0 if self._counter is None else self._counter.readings_per_turn
        times, uncounted = self._time.times(
            advance, came.now_s, turn, newest_s=came.newest_s, width_s=came.width_s
        )  # fmt: skip
        refuse_other_rate(self.name, self.settings.port, self._time.line)
        counts = self._counter is not None or self._format.time is not None
        lost = int(advance.sum()) - len(advance) + uncounted if counts else uncounted
        device_s = self._device_s(found, kept, times)
        return Readings(times, raw, valid, lost, damaged, device_s, self._stream.arrival_s(found.behind[kept]))

    def _device_s(
        self, found: Decoded, kept: NDArray[np.bool_], t_s: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return the times (n,) of readings by the unit's own clock, s; None where it tells none."""
        told = self._format.time or self._format.counter
        if self._device_time is None or told is None:
            return None
        return self._device_time.of(found.values[told.field][kept], t_s)

    def _advance(self, found: Decoded, kept: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return how many periods each reading, (n,), is from the one before."""
        if self._counter is not None and self._format.counter is not None:
            return self._counter.advance(found.values[self._format.counter.field][kept])
        if (ticks := stamp_ticks(self._format)) is not None:
            return self._advance_by_time(found.values[ticks.field], ticks)
        advance = np.ones(len(found), dtype=np.int64)
        advance[0] += found.damaged  # a damaged message has taken its sampling period too
        return advance

    def _advance_by_time(self, stamps: NDArray[np.int64], ticks: StampTicks) -> NDArray[np.int64]:
        """Return how many periods each reading, (n,), is from the one before by its time stamp, at least 1."""
        period = 1.0 / (self.sample_rate_hz * ticks.tick_s)
        moved = np.diff(stamps, prepend=stamps[0] - round(period) if self._stamp is None else self._stamp)
        if ticks.wrap is not None:
            moved %= ticks.wrap
        self._stamp = int(stamps[-1])
        return np.maximum(np.rint(moved / period), 1.0).astype(np.int64)


DRIVER = GyroDriver(
    StreamSettings,
    StreamFormatGyro,
    Trial("triaxial-sim", {"port": "sim://stream-format/mems", "format": "xsens-mti", "sample_rate_hz": 100}),
)
