"""Sensonor STIM300 in normal mode: a stream of binary datagrams with status, counter and CRC over RS-422."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.drivers import probes
from instruments.drivers.driver import GyroDriver
from instruments.drivers.streamed_readings import identify_stream
from instruments.errors import NoReply, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.interfaces.self_checks import StreamPeriod
from instruments.protocols.stim300.checks import DEFAULT_RATE_HZ, differences, is_other_serial
from instruments.protocols.stim300.datagrams import (
    ASK_BIAS_TRIM,
    ASK_CONFIGURATION,
    ASK_SERIAL_NUMBER,
    SAMPLE_RATES_HZ,
    Configuration,
    parse_bias_trim,
    parse_configuration,
    parse_serial_number,
)
from instruments.protocols.stim300.frames import (
    AXES,
    BAD_STATUS,
    COUNTS_PER_S,
    RATE_PER_LSB,
    SATURATION_DPS,
    TEMPERATURE_PER_LSB,
    int16,
    int24,
    layout_of,
    scan,
)
from instruments.protocols.stim300.layouts import SPECIALS
from instruments.protocols.stim300.settings import Stim300Settings
from instruments.transport.device_time import DeviceTime
from instruments.transport.factory import Ports
from instruments.transport.sample_counter import SampleCounter
from instruments.transport.sample_timing import FRESH_PERIODS, StreamTime, refuse_other_rate
from instruments.transport.serial_stream import SerialStream, line_of
from instruments.transport.stream_period import OF_A_CRYSTAL
from instruments.transport.undecided import Undecided

SILENCE_S = 2.0
COUNTER_WRAP = 256
#: Least size of a port's input buffer; the port is emptied when half of it can be full, and at least every second.
PORT_BUFFER_BYTES = 4096
EMPTY_EVERY_S = 1.0
START_WITHIN_S = 1.5
#: A question that was not answered is put again after this, s.
ASK_EVERY_S = 0.4
#: So often the bias trim offset is asked for: older firmware does not know the question.
TRIM_QUESTIONS = 2


class Stim300:
    """Driver of a STIM300 in normal mode.

    After each start the unit is asked for its configuration, serial number and bias trim offset before its first
    reading is passed on.
    What it reports later, after a reset, is checked in the same way.
    """

    def __init__(self, settings: Stim300Settings, ports: Ports, clock: Clock) -> None:
        self.name = settings.name
        self.settings = settings
        self.options = settings.options
        self.layout = layout_of(self.options)
        self.axes: tuple[str, ...] = tuple(settings.axes)
        self.sample_rate_hz = settings.sample_rate_hz or DEFAULT_RATE_HZ
        self.limits = GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)
        half_full_s = 0.5 * PORT_BUFFER_BYTES / (self.layout.stride * self.sample_rate_hz)
        self._empty_every_s = min(EMPTY_EVERY_S, half_full_s)
        self._clock = clock
        self._stream = SerialStream(
            self.name, settings.port or "", ports, clock, baudrate=self.options.baudrate, timeout_s=SILENCE_S,
            line=line_of(self.options),
        )  # fmt: skip
        self._unfinished = b""
        self._counter = SampleCounter(
            self.name, settings.port, step=round(COUNTS_PER_S / self.sample_rate_hz), wrap=COUNTER_WRAP
        )
        self._time = StreamTime(1.0 / self.sample_rate_hz, 0.0, OF_A_CRYSTAL)
        self._device_time = DeviceTime(1.0 / COUNTS_PER_S, COUNTER_WRAP)
        self._undecided = Undecided()
        self._last_frame_s = 0.0
        self._set: Configuration | None = None  # as the unit says
        self._serial: str | None = None
        self._trim_dps: tuple[float, ...] | None = None
        self._questions = 0  #: since the start

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What a datagram holds: rates in deg/s, temperatures in deg C where it has them, and the status byte."""
        rates = [Channel(f"gyro_{axis}", "deg/s", RATE_PER_LSB) for axis in self.axes]
        temperature_channels = [Channel(f"temperature_{axis}_c", "deg C", TEMPERATURE_PER_LSB) for axis in self.axes]
        return (
            *rates,
            *(temperature_channels if self.layout.temperature is not None else ()),
            Channel("status", "", 1.0),
        )

    def identify(self) -> GyroIdentity:
        """Get the unit's identity: the name of the bench file, and what the unit and its adapter say.

        Raises WrongInstrument for a unit that is another one or set otherwise, NoReply, LinkError.
        """
        adapter, usual = self.options.adapter, ("Sensonor STIM300", "mems")
        return identify_stream(self, self.settings, self._stream, usual, adapter=adapter, reported=self._reported)

    def start(self) -> None:
        """Open the port and drop stale bytes; raises LinkError."""
        self._stream.open()
        self._set = self._serial = self._trim_dps = None
        self._questions = 0
        self._discard()
        self._last_frame_s = self._clock.now_s()
        self._time = StreamTime(1.0 / self.sample_rate_hz, self._last_frame_s, OF_A_CRYSTAL)
        self._device_time = DeviceTime(1.0 / COUNTS_PER_S, COUNTER_WRAP)

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds; fewer where the stream has gaps.

        Raises NoReply after SILENCE_S without an intact datagram, and LinkError.
        """
        readings = self._decode(self._stream.read_for(duration_s, self._empty_every_s))
        now_s = self._clock.now_s()
        if now_s - self._last_frame_s > SILENCE_S:
            raise self._no_datagram(f"for {now_s - self._last_frame_s:.1f} s")
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; the first time, ask the unit how it is set.

        Raises NoReply after START_WITHIN_S, WrongInstrument, LinkError.
        """
        self._discard()
        newest, began_s = None, self._clock.now_s()
        ask_s = began_s
        while (now_s := self._clock.now_s()) < began_s + START_WITHIN_S:
            if self._is_unknown and now_s >= ask_s:
                self._stream.write(ASK_CONFIGURATION + ASK_SERIAL_NUMBER + ASK_BIAS_TRIM)
                self._questions += 1
                ask_s = now_s + ASK_EVERY_S
            self._clock.sleep(FRESH_PERIODS / self.sample_rate_hz)
            data = self._stream.read_available()
            if data and len(readings := self._decode(data)):
                newest = readings.newest()
            if newest is not None and not self._is_unknown:
                return newest
        raise self._no_datagram(f"within {START_WITHIN_S:g} s") if newest is None else self._no_answer()

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        self._stream.close()

    def kept_back(self) -> Readings | None:
        """Get the readings that are kept back because the stream is late, each once; None where none are."""
        return self._undecided.take(self._device_time)

    @property
    def period(self) -> StreamPeriod:
        """Get what is known of the period since the start."""
        return self._time.known

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock, so that readings may be lost."""
        return self._time.is_late

    @property
    def counter_step(self) -> tuple[int, int] | None:
        """Get the usual step of the counter, and that of the bench file's rate; None before two datagrams came."""
        step = self._counter.step
        return None if step is None else (step, round(COUNTS_PER_S / self.sample_rate_hz))

    def _discard(self) -> None:
        self._stream.discard_input()
        self._unfinished = b""
        self._counter.drop()
        self._time.drop()
        self._undecided.drop()

    def _no_datagram(self, when: str) -> NoReply:
        options = self.options
        advice = self._stream.advice(f"bit rate {options.baudrate}, datagram 0x{options.datagram:02X} and crlf")
        return NoReply(self.name, f"no intact datagram on {self.settings.port} {when}: {advice}")

    def _no_answer(self) -> NoReply:
        return NoReply(
            self.name,
            f"sends datagrams on {self.settings.port} but does not answer the commands C and I within "
            f"{START_WITHIN_S:g} s; check the wire to the unit's receiver, or set options.ask = false if there is no "
            "such wire",
        )

    @property
    def _possible_rates_hz(self) -> tuple[int, ...]:
        """What the unit can be set to; none where something else triggers it."""
        triggered = self._set is not None and self._set.sample_rate_hz is None
        return () if triggered or self.sample_rate_hz not in SAMPLE_RATES_HZ else SAMPLE_RATES_HZ

    @property
    def _is_unknown(self) -> bool:
        """Whether the unit has yet to report its configuration, serial number and, if it knows it, bias trim offset."""
        trim = self._trim_dps is None and self._questions < TRIM_QUESTIONS
        return self.options.ask and (self._set is None or self._serial is None or trim)

    def _hear(self, special: bytes) -> None:
        """Take in what the unit says of itself; raises WrongInstrument where its bench file says otherwise."""
        if (configuration := parse_configuration(special)) is not None:
            if differing := differences(configuration, self.settings):
                raise WrongInstrument(
                    self.name,
                    f"the unit on {self.settings.port} is not configured as the bench file requires: "
                    f"{'; '.join(differing)}; configure the unit in its service mode (commands u, m, d), or correct "
                    "the bench file",
                )
            self._set = configuration
        elif (serial := parse_serial_number(special)) is not None:
            self._refuse_other_unit(serial)
            self._serial = serial
        elif (trim_dps := parse_bias_trim(special)) is not None:
            self._trim_dps = trim_dps

    def _refuse_other_unit(self, serial: str) -> None:
        settings = self.settings
        if settings.own_serial not in {None, serial}:
            expected_serial = settings.own_serial
        elif is_other_serial(serial, settings.serial):
            expected_serial = settings.serial
        else:
            return
        raise WrongInstrument(
            self.name,
            f"the unit on {settings.port} has serial number {serial}, but the bench file or the "
            f"campaign names {expected_serial}; connect "
            "the "
            "right unit, or correct port, serial or own_serial",
        )

    def _reported(self) -> dict[str, str]:
        """Return what the unit has said of itself."""
        reported = {} if self._serial is None else {"serial": self._serial}
        if self._set is not None:
            set_unit = f"{self._set.unit}, delayed" if self._set.is_delayed else self._set.unit
            reported |= {
                "firmware": str(self._set.firmware), "revision": self._set.revision, "output_unit": set_unit,
                "filter_hz": " ".join(self._set.filters_hz), "g_compensation": self._set.g_compensation,
                "range_dps": " ".join(self._set.ranges_dps), "datagram": f"0x{self.options.datagram:02X}",
                "sample_rate_hz": str(self._set.sample_rate_hz or "external trigger"),
            }  # fmt: skip
        if self._trim_dps is not None:
            reported["bias_trim_dps"] = " ".join(f"{each:.5g}" for each in self._trim_dps)
        return reported

    def _decode(self, data: bytes) -> Readings:
        scanned = scan(self._unfinished + data, self.layout)
        self._unfinished = scanned.rest
        for special in scanned.specials:
            self._stream.answered(SPECIALS[special[0]].stride)
            self._hear(special)
        frames, layout, behind = scanned.frames, self.layout, scanned.behind
        damaged = scanned.damaged
        if len(frames):
            new = self._counter.is_new(frames[:, layout.counter].astype(np.int64), frames)
            if not new.all():
                frames, behind, damaged = frames[new], behind[new], damaged + len(new) - int(new.sum())
        if len(frames) == 0:
            return Readings(
                np.zeros(0), {c.name: np.zeros(0, dtype=np.int64) for c in self.channels}, np.zeros(0, bool), 0,
                damaged, np.zeros(0), np.zeros(0),
            )  # fmt: skip
        rates = int24(frames, 1).astype(np.int64)
        status = frames[:, layout.status].astype(np.int64)
        valid = (status & BAD_STATUS) == 0
        valid &= np.all(np.abs(rates) < SATURATION_DPS / RATE_PER_LSB, axis=1)
        raw: dict[str, NDArray[np.int64]] = {f"gyro_{axis}": rates[:, AXES.index(axis)] for axis in self.axes}
        if layout.temperature is not None and layout.temperature_status is not None:
            temperature_codes = int16(frames, layout.temperature).astype(np.int64)
            raw |= {f"temperature_{axis}_c": temperature_codes[:, AXES.index(axis)] for axis in self.axes}
            valid &= (frames[:, layout.temperature_status] & BAD_STATUS) == 0
        raw["status"] = status
        counter = frames[:, layout.counter].astype(np.int64)
        self._last_frame_s, self._stream.unused = self._clock.now_s(), 0
        arrival_s = self._stream.arrival_s(behind)
        times, lost = self._times(counter, arrival_s)
        readings = Readings(times, raw, valid, lost, damaged, None, arrival_s)
        return self._undecided.pass_on(readings, self._time, self._device_time, counter)

    def _times(self, counter: NDArray[np.int64], arrival_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
        """Return the clock times of frames, (n,) s, and the number of frames missing by counter and by clock."""
        advance = self._counter.advance(counter)
        came = self._stream.last
        times, uncounted = self._time.times(
            advance, came.now_s, self._counter.readings_per_turn, width_s=came.width_s, arrival_s=arrival_s
        )
        refuse_other_rate(self.name, self.settings.port, self._time.line, self._possible_rates_hz)
        return times, int(advance.sum() - len(advance)) + uncounted


DRIVER = GyroDriver(Stim300Settings, Stim300, probe=probes.STIM300)
