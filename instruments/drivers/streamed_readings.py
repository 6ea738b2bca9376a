"""Readings of a stream that a decoder takes apart: their times, their counter, what is lost, damaged or silent."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.errors import NoReply
from instruments.interfaces.gyro import Readings
from instruments.protocols.stream_formats.document import Counter
from instruments.protocols.stream_formats.readings import Decoded, Decoder, StampTicks
from instruments.transport.device_time import DeviceTime
from instruments.transport.sample_counter import SampleCounter
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime, refuse_other_rate
from instruments.transport.serial_stream import SerialStream
from instruments.transport.undecided import Undecided

SILENCE_S = 2.0
#: Least size of a port's input buffer; a simulated port is emptied when half of it can be full.
PORT_BUFFER_BYTES, EMPTY_EVERY_S, LONG_MESSAGE_BYTES = 4096, 1.0, 160


@dataclass(frozen=True)
class StreamLaw:
    """What is known of a stream: its readings per second, the channels that are kept, its counter and time stamps."""

    rate_hz: float
    channels: Sequence[str]
    counter: Counter | None
    stamps: StampTicks | None = None


class StreamedReadings:
    """Readings of a gyro that sends them unasked. `unread` says what came in place of a reading, and what to check."""

    def __init__(
        self,
        device: str,
        port: str,
        stream: SerialStream,
        decoder: Decoder,
        law: StreamLaw,
        clock: Clock,
        unread: Callable[[SerialStream, float], str],
    ) -> None:
        self._device, self._port, self._stream, self._decoder = device, port, stream, decoder
        self._law, self._clock, self._unread = law, clock, unread
        half_full_s = 0.5 * PORT_BUFFER_BYTES / (LONG_MESSAGE_BYTES * law.rate_hz)
        self._empty_every_s = min(EMPTY_EVERY_S, half_full_s)
        self._counter = self._new_counter()
        self._stamp: int | None = None  #: time stamp of the newest reading
        self._time = StreamTime(1.0 / law.rate_hz, 0.0)
        self._device_time = self._new_device_time()
        self._undecided = Undecided()
        self._last_s = 0.0

    @property
    def is_late(self) -> bool:
        """Whether the stream is too far behind the clock, so that readings may be lost."""
        return self._time.is_late

    def begin(self, requests: Sequence[bytes]) -> None:
        """Open the port, send what starts the stream, drop what is old; raises LinkError."""
        self._stream.open()
        for request in requests:
            self._stream.write(request)
        self._counter = self._new_counter()
        self._device_time = self._new_device_time()
        self._discard()
        self._last_s = self._clock.now_s()
        self._time = StreamTime(1.0 / self._law.rate_hz, self._last_s)

    def read(self, duration_s: float) -> Readings:
        """Return every reading of the next `duration_s` seconds; fewer where messages are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a reading; MalformedReply for a counter that
        stands; WrongInstrument for another rate; LinkError.
        """
        readings = self._decode(self._stream.read_for(duration_s, self._empty_every_s))
        now_s = self._clock.now_s()
        if now_s - self._last_s > self._silence_s:
            raise self._no_reading(now_s - self._last_s)
        return readings

    def read_latest(self) -> Readings:
        """Return one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        self._discard()
        began_s = self._clock.now_s()
        while self._clock.now_s() < began_s + self._silence_s:
            self._clock.sleep(FRESH_PERIODS / self._law.rate_hz)
            data = self._stream.read_available()
            if data and len(readings := self._decode(data)):
                return readings.newest()
        raise self._no_reading(self._clock.now_s() - began_s)

    @property
    def _silence_s(self) -> float:
        return max(SILENCE_S, 5 / self._law.rate_hz)

    def _new_counter(self) -> SampleCounter | None:
        counter_law = self._law.counter
        return (
            None
            if counter_law is None
            else SampleCounter(self._device, self._port, step=counter_law.step, wrap=counter_law.wrap)
        )

    def _new_device_time(self) -> DeviceTime | None:
        """Return the unit's own time: by its time stamps, or by its counter; None without either."""
        if (ticks := self._law.stamps) is not None:
            return DeviceTime(ticks.tick_s, ticks.wrap)
        if (counter_law := self._law.counter) is not None:
            return DeviceTime(1.0 / (self._law.rate_hz * counter_law.step), counter_law.wrap)
        return None

    def _discard(self) -> None:
        self._stream.discard_input()
        self._decoder.drop()
        self._stamp = None
        if self._counter is not None:
            self._counter.drop()
        self._time.drop()
        self._undecided.drop()

    def _no_reading(self, silence_s: float) -> NoReply:
        return NoReply(self._device, self._unread(self._stream, silence_s))

    def _decode(self, data: bytes) -> Readings:
        decoded = self._decoder.feed(data)
        damaged, is_used = decoded.damaged, np.ones(len(decoded), dtype=bool)
        if self._counter is not None and self._law.counter is not None and len(decoded):
            content = np.stack(list(decoded.values.values()), axis=1)
            is_used = self._counter.is_new(decoded.values[self._law.counter.field], content)
            damaged += len(is_used) - int(is_used.sum())
        raw = {name: decoded.values[name][is_used] for name in self._law.channels}
        valid = decoded.valid[is_used]
        if not len(valid):
            device_s = None if self._device_time is None else np.zeros(0)
            return Readings(np.zeros(0), raw, valid, 0, damaged, device_s, np.zeros(0))
        self._last_s, self._stream.unused = self._clock.now_s(), 0
        advance = self._advance(decoded, is_used)
        came, arrival_s = self._stream.last, self._stream.arrival_s(decoded.behind[is_used])
        turn = 0 if self._counter is None else self._counter.readings_per_turn
        times, uncounted = self._time.times(advance, came.now_s, turn, width_s=came.width_s, arrival_s=arrival_s)
        refuse_other_rate(self._device, self._port, self._time.line)
        counts = self._counter is not None or self._law.stamps is not None
        lost = int(advance.sum()) - len(advance) + uncounted if counts else uncounted
        has_stamp = self._law.stamps or self._law.counter
        ticks = None if has_stamp is None else decoded.values[has_stamp.field][is_used].astype(np.int64)
        readings = Readings(times, raw, valid, lost, damaged, None, arrival_s)
        return self._undecided.pass_on(readings, self._time, self._device_time, ticks)

    def _advance(self, decoded: Decoded, is_used: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return how many periods each reading, (n,), is from the one before."""
        if self._counter is not None and self._law.counter is not None:
            return self._counter.advance(decoded.values[self._law.counter.field][is_used])
        if (ticks := self._law.stamps) is not None:
            return self._advance_by_time(decoded.values[ticks.field], ticks)
        advance = np.ones(len(decoded), dtype=np.int64)
        # a damaged message has taken its sampling period too
        advance[0] += decoded.damaged if decoded.missed is None else decoded.missed
        return advance

    def _advance_by_time(self, stamps: NDArray[np.int64], ticks: StampTicks) -> NDArray[np.int64]:
        """Return how many periods each reading, (n,), is from the one before by its time stamp, at least 1."""
        period = 1.0 / (self._law.rate_hz * ticks.tick_s)
        moved = np.diff(stamps, prepend=stamps[0] - round(period) if self._stamp is None else self._stamp)
        if ticks.wrap is not None:
            moved %= ticks.wrap
        self._stamp = int(stamps[-1])
        return np.maximum(np.rint(moved / period), 1.0).astype(np.int64)
