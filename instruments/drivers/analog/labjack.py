"""Analog gyros on a LabJack T7 or T4: the device scans its inputs by its own clock and streams them over TCP."""

from __future__ import annotations

import contextlib
import struct

import numpy as np

from instruments.clock import Clock
from instruments.drivers.analog.analog_readings import (
    AnalogReadings,
    Scans,
    analog_channels,
    analog_identity,
    limits_of,
)
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import InstrumentError, LimitError, LinkError, NoReply, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from instruments.protocols.analog_settings import LabJackSettings
from instruments.protocols.labjack import registers as lj
from instruments.protocols.labjack import stream
from instruments.protocols.labjack.scans import PacketScans
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client
from instruments.transport.serial_stream import SerialStream

REPLY_S = 1.0
SILENCE_S = 2.0
#: The stream is emptied this often at least, s, and after so many bytes; a thread empties a real one all the time.
EMPTY_EVERY_S, EMPTY_BYTES = 1.0, 2048
PACKETS_PER_S = 20.0
#: The device takes the nearest rate that its clock can make.
RATE_TOLERANCE = 0.01
LOWEST_CODE, HIGHEST_CODE = 0, 65535


class LabJackGyro:
    """Driver of analog gyros on one LabJack. A reading is the sum of whole codes: nothing is rounded."""

    def __init__(self, settings: LabJackSettings, ports: Ports, clock: Clock) -> None:
        self.name, self.settings = settings.name, settings
        self.axes: tuple[str, ...] = settings.axes
        self.limits = limits_of(settings)
        self.scans_per_s = settings.scans_per_s
        self.sample_rate_hz = settings.scans_per_s / settings.options.average
        self._clock, self._inputs = clock, settings.options.all_inputs
        self._readings = AnalogReadings(settings, settings.stream_url)
        self._packets = PacketScans(len(self._inputs), self._scans_per_packet)

        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        self._registers = Registers(self.name, 1, clock, link, word_order="big")
        self._stream = SerialStream(self.name, settings.stream_url, ports, clock, baudrate=115200, timeout_s=SILENCE_S)
        self._empty_every_s = min(EMPTY_EVERY_S, EMPTY_BYTES / (2 * len(self._inputs) * self.scans_per_s))
        self._unfinished = b""
        self._last_s = 0.0
        self._model, self._said = "LabJack", dict[str, str]()
        self._scaling: list[tuple[float, float]] | None = None

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the voltages, by the calibration constants of the device, which the first use reads."""
        return analog_channels(self.settings, self._known_scaling())

    def identify(self) -> GyroIdentity:
        """Get the unit's identity by the bench file, after the device was asked and one reading came.

        Raises WrongInstrument for a device that is no T7 or T4, LimitError for a range that it does not have.
        """
        self._known_scaling()
        was_open = self._stream.is_open
        self.start()
        self.read_latest()
        if not was_open:
            self.stop()
        return analog_identity(self.settings, f"analog gyro on {self._model}", self._said)

    def start(self) -> None:
        """Set up and start the stream; one that runs goes on. Raises InstrumentError."""
        if self._stream.is_open:
            self._discard()
            return
        self._configure()
        self._stream.open()
        self._readings.start(self._clock.now_s())
        self._registers.put(lj.ENABLE, 1)
        scan_rate_hz = self._registers.get(lj.SCAN_RATE)
        if abs(scan_rate_hz / self.scans_per_s - 1.0) > RATE_TOLERANCE:
            self.stop()
            raise WrongInstrument(
                self.name,
                f"scans {scan_rate_hz:g} times per second, but the bench file states {self.scans_per_s:g}; set "
                f"sample_rate_hz = {scan_rate_hz:g}",
            )
        self._discard()
        self._last_s = self._clock.now_s()

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds. Raises NoReply after SILENCE_S without one, LinkError."""
        readings = self._decode(self._stream.read_for(duration_s, self._empty_every_s))
        now_s = self._clock.now_s()
        if len(readings):
            self._last_s = now_s
        elif now_s - self._last_s > SILENCE_S:
            raise self._silent(now_s - self._last_s)
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        self._discard()
        began_s = self._clock.now_s()
        while self._clock.now_s() < began_s + SILENCE_S:
            self._clock.sleep(0.5 / PACKETS_PER_S)
            data = self._stream.read_available()
            if data and len(readings := self._decode(data)):
                self._last_s = self._clock.now_s()
                return readings.newest()
        raise self._silent(SILENCE_S)

    def stop(self) -> None:
        """Stop the stream and close both links; safe to call twice, and without a reply."""
        if self._stream.is_open:
            self._stream.close()
            with contextlib.suppress(InstrumentError):  # the next start ends a stream that goes on
                self._registers.put(lj.ENABLE, 0)
        self._registers.close()

    def _known_scaling(self) -> list[tuple[float, float]]:
        if self._scaling is None:
            product = round(self._registers.get(lj.PRODUCT_ID))
            if product not in (lj.T4, lj.T7):
                raise WrongInstrument(
                    self.name,
                    f"{self.settings.host} reports product number {product}, which is not a LabJack "
                    "T4 or T7; check the host",
                )
            self._model = f"LabJack T{product}"
            self._said = {"inputs": f"{self._model} {self._registers.get_int(lj.SERIAL_NUMBER)}"}
            constants = self._constants()
            scalings = [self._scaling_of(product, constants, number) for number in self._inputs]
            self._scaling = [(scaling.slope_v, scaling.centre) for scaling in scalings]
        return self._scaling

    def _scaling_of(self, product: int, constants: list[float], number: int) -> lj.Scaling:
        if product == lj.T4:
            return lj.t4_scaling(constants, number)
        try:
            scaling = lj.t7_scaling(constants, lj.gain_index(self.settings.options.range_v))
        except ValueError as error:
            raise LimitError(self.name, f"{error}; correct options.range_v in the bench file") from error
        if scaling.kink > lj.LARGEST_KINK:
            raise WrongInstrument(
                self.name,
                f"the slopes of its input below and above mid-range differ by {1e6 * scaling.kink:.0f} ppm, limit "
                f"{1e6 * lj.LARGEST_KINK:.0f} ppm; check the calibration of the device",
            )
        return scaling

    def _constants(self) -> list[float]:
        """Return the calibration constants from the device's flash."""
        constants: list[float] = []
        for frame in range(2):
            self._registers.put(lj.FLASH_POINTER, lj.CONSTANTS_AT + 4 * lj.FRAME * frame)
            words = self._registers.words(lj.FLASH, 2 * lj.FRAME)
            constants += struct.unpack(f">{lj.FRAME}f", struct.pack(f">{len(words)}H", *words))
        return constants

    def _configure(self) -> None:
        """End a stream that runs, and set up inputs and stream."""
        put, settings, inputs = self._registers.put, self.settings, self._inputs
        self._known_scaling()
        if self._registers.get(lj.ENABLE):
            put(lj.ENABLE, 0)
        negative = [number + 1 if settings.options.differential else lj.SINGLE_ENDED for number in inputs]
        for number, below in zip(inputs, negative, strict=True):
            put(lj.AIN_RANGE.nth(number, 2, first=0), settings.options.range_v)
            put(lj.AIN_NEGATIVE.nth(number, 1, first=0), below)
        put(lj.SCAN_RATE, self.scans_per_s)
        put(lj.NUMBER_OF_ADDRESSES, len(inputs))
        put(lj.SAMPLES_PER_PACKET, self._scans_per_packet * len(inputs))
        put(lj.SETTLING, settings.settling_us)
        put(lj.RESOLUTION_INDEX, settings.resolution_index)
        put(lj.BUFFER_BYTES, lj.LARGEST_BUFFER)
        put(lj.AUTO_TARGET, lj.ETHERNET)
        put(lj.DATA_TYPE, 0)
        put(lj.NUMBER_OF_SCANS, 0)
        for place, number in enumerate(inputs):
            put(lj.SCAN_LIST.nth(place, 2, first=0), 2 * number)

    @property
    def _scans_per_packet(self) -> int:
        """Scans of a packet: whole readings where they fit."""
        average, most = self.settings.options.average, lj.MAX_SAMPLES_PER_PACKET // len(self._inputs)
        scans = min(max(round(self.scans_per_s / PACKETS_PER_S), 1), most)
        return scans if average > scans else scans - scans % average

    def _discard(self) -> None:
        self._stream.discard_input()
        self._unfinished = b""
        self._packets.drop()
        self._readings.drop()

    def _silent(self, silent_s: float) -> NoReply:
        return NoReply(
            self.name,
            f"no scan from {self.settings.stream_url} for {silent_s:.1f} s; check network, power, and that no "
            "other program uses the stream",
        )

    def _decode(self, data: bytes) -> Readings:
        packets, self._unfinished, damaged = stream.split(self._unfinished + data)
        for packet in packets:
            if (reason := stream.FATAL.get(packet.status)) is not None:
                self.stop()
                raise LinkError(
                    self.name,
                    f"the stream ended (status {packet.status}): {reason}; check the device, then start the stream "
                    "again",
                )
        numbers, codes, behind = self._packets.add(packets)
        good = np.all((codes > LOWEST_CODE) & (codes < HIGHEST_CODE), axis=1)
        came = self._stream.last
        scans = Scans(numbers, codes, good, self._stream.arrival_s(behind))
        return self._readings.add(scans, (came.now_s, came.newest_s, came.width_s), damaged)


DRIVER = GyroDriver(
    LabJackSettings,
    LabJackGyro,
    Trial(
        section={
            "host": "sim://labjack-t7/fog",
            "port": "sim://labjack-t7-stream/fog",
            "sample_rate_hz": 1000,
            "options": {"average": 10, "thermometer_input": 2},
        }
    ),
)
