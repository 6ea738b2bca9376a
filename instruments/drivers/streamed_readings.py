"""Gyros that send unasked: what their drivers share, and the readings of a stream that a decoder takes apart."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import GyroSettings
from instruments.clock import Clock
from instruments.errors import NoReply
from instruments.interfaces.gyro import Gyro, GyroIdentity, Readings
from instruments.interfaces.self_checks import StreamPeriod
from instruments.protocols.stream_formats.document import Counter
from instruments.protocols.stream_formats.readings import Decoded, Decoder, PulseTicks, StampTicks
from instruments.transport.adapters import require_adapter
from instruments.transport.device_time import CountedPulseTime, DeviceClock, DeviceTime, PulseTime
from instruments.transport.sample_counter import SampleCounter
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime, refuse_other_rate
from instruments.transport.serial_stream import SerialStream
from instruments.transport.undecided import Undecided

SILENCE_S = 2.0
#: Least size of a port's input buffer; a simulated port is emptied when half of it can be full.
PORT_BUFFER_BYTES, EMPTY_EVERY_S, LONG_MESSAGE_BYTES = 4096, 1.0, 160


def identify_stream(
    gyro: Gyro, settings: GyroSettings, stream: SerialStream, usual: tuple[str, str], *, adapter: str | None = None,
    reported: Callable[[], Mapping[str, str]] = dict,
) -> GyroIdentity:  # fmt: skip
    """Return the identity of a unit by its bench file and by what it reports, after one reading came.

    `usual` are the model and the technology where the bench file gives none; a stream that was closed is closed
    again. Raises WrongInstrument where the port is on another USB adapter than `adapter`, NoReply, LinkError.
    """
    on = require_adapter(gyro.name, settings.port, adapter)
    was_open = stream.is_open
    gyro.start()
    gyro.read_latest()
    if not was_open:
        gyro.stop()
    model, technology = settings.model or usual[0], settings.technology or usual[1]
    return GyroIdentity(settings.serial, model, technology, settings.datasheet, reported={**reported(), **on})


@dataclass(frozen=True)
class StreamLaw:
    """What is known of a stream: its readings per second, the channels that are kept, its counter and time stamps."""

    rate_hz: float
    channels: Sequence[str]
    counter: Counter | None
    stamps: StampTicks | None = None
    pulses: PulseTicks | None = None


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

    def kept_back(self) -> Readings | None:
        """Return the readings that are kept back because the stream is late, each once; None where none are."""
        return self._undecided.take(self._device_time)

    @property
    def period(self) -> StreamPeriod:
        """What is known of the period since `begin`."""
        return self._time.known

    @property
    def counter_step(self) -> tuple[int, int] | None:
        """Usual step of the counter, and the one that is stated; None without, and before two readings came."""
        step = None if self._counter is None else self._counter.step
        return None if step is None or self._law.counter is None else (step, self._law.counter.step)

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
        counter = self._law.counter
        return (
            None if counter is None else SampleCounter(self._device, self._port, step=counter.step, wrap=counter.wrap)
        )

    def _new_device_time(self) -> DeviceClock | None:
        """Return the unit's own time: by pulses, by its time stamps, or by its counter; None without any."""
        device_time, pulses = self._new_own_time(), self._law.pulses
        if pulses is None:
            return device_time
        if pulses.tick_s:
            return PulseTime(pulses.tick_s, pulses.interval_s)
        return None if device_time is None else CountedPulseTime(device_time, pulses.interval_s)

    def _new_own_time(self) -> DeviceTime | None:
        if (ticks := self._law.stamps) is not None:
            return DeviceTime(ticks.tick_s, ticks.wrap)
        if (counter := self._law.counter) is not None:
            return DeviceTime(1.0 / (self._law.rate_hz * counter.step), counter.wrap)
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
        damaged, kept = decoded.damaged, np.ones(len(decoded), dtype=bool)
        if self._counter is not None and self._law.counter is not None and len(decoded):
            content = np.stack(list(decoded.values.values()), axis=1)
            kept = self._counter.is_new(decoded.values[self._law.counter.field], content)
            damaged += len(kept) - int(kept.sum())
        raw = {name: decoded.values[name][kept] for name in self._law.channels}
        valid = decoded.valid[kept]
        if not len(valid):
            device_s = None if self._device_time is None else np.zeros(0)
            return Readings(np.zeros(0), raw, valid, 0, damaged, device_s, np.zeros(0))
        self._last_s, self._stream.unused = self._clock.now_s(), 0
        advance = self._advance(decoded, kept)
        came, arrival_s = self._stream.last, self._stream.arrival_s(decoded.behind[kept])
        turn = 0 if self._counter is None else self._counter.readings_per_turn
        times, uncounted = self._time.times(advance, came.now_s, turn, width_s=came.width_s, arrival_s=arrival_s)
        refuse_other_rate(self._device, self._port, self._time.line)
        counts = self._counter is not None or self._law.stamps is not None
        lost = int(advance.sum()) - len(advance) + uncounted if counts else uncounted
        ticks = self._ticks(decoded, kept)
        readings = Readings(times, raw, valid, lost, damaged, None, arrival_s)
        return self._undecided.pass_on(readings, self._time, self._device_time, ticks)

    def _ticks(self, decoded: Decoded, kept: NDArray[np.bool_]) -> NDArray[np.int64] | None:
        """Return what each reading says of the unit's own time, (n,), or (n, 2) with the number of pulses."""
        time_field, pulses = self._law.stamps or self._law.counter, self._law.pulses
        if time_field is None and pulses is None:
            return None
        fields = [each.field for each in (time_field, pulses) if each is not None]
        if pulses is not None and pulses.tick_s:
            fields = [pulses.field]
        columns = [decoded.values[field][kept].astype(np.int64) for field in fields]
        return columns[0] if len(columns) == 1 else np.stack(columns, axis=1)

    def _advance(self, decoded: Decoded, kept: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return how many periods each reading, (n,), is from the one before."""
        if self._counter is not None and self._law.counter is not None:
            return self._counter.advance(decoded.values[self._law.counter.field][kept])
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


class StreamedGyro:
    """Part of the drivers whose units a file describes: the stream, its period and its end."""

    def __init__(self, stream: SerialStream, readings: StreamedReadings) -> None:
        self._stream, self._readings = stream, readings

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where messages are missing.

        Raises NoReply after SILENCE_S, or five sampling periods, without a reading; MalformedReply for a counter that
        stands; WrongInstrument for another rate; LinkError.
        """
        return self._readings.read(duration_s)

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        return self._readings.read_latest()

    def stop(self) -> None:
        """Control the stream: close it; safe to call twice."""
        self._stream.close()

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock, so that readings may be lost."""
        return self._readings.is_late

    def kept_back(self) -> Readings | None:
        """Get the readings that are kept back because the stream is late, each once; None where none are."""
        return self._readings.kept_back()

    @property
    def period(self) -> StreamPeriod:
        """Get what is known of the period since the start."""
        return self._readings.period

    @property
    def counter_step(self) -> tuple[int, int] | None:
        """Get the usual step of the counter, and the one that is stated; None without, and before two readings."""
        return self._readings.counter_step
