"""Analog gyros on a device of National Instruments, through the package nidaqmx (optional extra `nidaq`).

The hardware's own clock paces the scans, and the driver software of National Instruments buffers them: that of this
computer, or that of another one, behind NI's gRPC device server (extra `nidaq-grpc`). Not tried on hardware: the tests
drive a simulated server through nidaqmx itself.
"""

from __future__ import annotations

import numpy as np

from instruments.clock import Clock
from instruments.drivers.analog.analog_readings import AnalogReadings, analog_channels, analog_identity, limits_of
from instruments.drivers.analog.nidaqmx_task import NidaqmxTask
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import NoReply, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from instruments.protocols.analog_settings import NidaqSettings
from instruments.transport.factory import Ports

#: A raw value is the sum of voltages in whole steps of this, V: finer than any converter of the kind.
STEP_V = 1e-7
SILENCE_S = 2.0
LOOK_EVERY_S = 0.1
RATE_TOLERANCE = 0.01
#: A scan is in the buffer of the computer within this time, s.
TRANSFER_S = 0.02


class NidaqGyro:
    """Driver of analog gyros on one device. Every error of nidaqmx becomes a LinkError in one line."""

    def __init__(self, settings: NidaqSettings, ports: Ports, clock: Clock) -> None:
        self.name, self.settings = settings.name, settings
        self.axes: tuple[str, ...] = settings.axes
        self.limits = limits_of(settings)
        self.sample_rate_hz = settings.scans_per_s / settings.options.average
        self._clock, self._inputs = clock, settings.options.all_inputs
        self._readings = AnalogReadings(settings, settings.address)
        self._task = NidaqmxTask(settings, ports)
        self._taken = 0  #: scans that were read
        self._last_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the voltages, in whole steps of 0.1 microvolt."""
        return analog_channels(self.settings, [(STEP_V, 0.0)] * len(self._inputs))

    def identify(self) -> GyroIdentity:
        """Get the unit's identity by the bench file, after one reading came; raises LinkError, NoReply."""
        was_open = self._task.is_open
        self.start()
        said = {"inputs": f"{self._task.product() or 'NI-DAQ'} {self.settings.device}"}
        self.read_latest()
        if not was_open:
            self.stop()
        return analog_identity(self.settings, f"analog gyro on {said['inputs']}", said)

    def start(self) -> None:
        """Control the scans: begin; those that run go on. Raises LinkError, WrongInstrument for another rate."""
        if self._task.is_open:
            self._discard()
            return
        found, wanted = self._task.open(), self.settings.scans_per_s
        if abs(found / wanted - 1.0) > RATE_TOLERANCE:
            self.stop()
            raise WrongInstrument(
                self.name,
                f"scans {found:g} times per second, but the bench file states {wanted:g}; set "
                f"sample_rate_hz = {found:g}",
            )
        self._taken = 0
        self._last_s = self._clock.now_s()
        self._readings.start(self._last_s)

    def read(self, duration_s: float) -> Readings:
        """Get every reading of the next `duration_s` seconds. Raises NoReply after SILENCE_S without one, LinkError."""
        self._clock.sleep(duration_s)
        readings = self._available()
        now_s = self._clock.now_s()
        if len(readings):
            self._last_s = now_s
        elif now_s - self._last_s > SILENCE_S:
            raise self._silent()
        return readings

    def read_latest(self) -> Readings:
        """Get one fresh reading and drop everything older; raises NoReply after SILENCE_S, LinkError."""
        self._discard()
        began_s = self._clock.now_s()
        while self._clock.now_s() < began_s + max(SILENCE_S, 3 / self.sample_rate_hz):
            self._clock.sleep(min(LOOK_EVERY_S, 0.5 / self.sample_rate_hz))
            if len(readings := self._available()):
                self._last_s = self._clock.now_s()
                return readings.newest()
        raise self._silent()

    def stop(self) -> None:
        """Control the scans: end them; safe to call twice, and where nidaqmx fails."""
        self._task.close()

    def _available(self) -> Readings:
        """Return the readings of all scans that the buffer holds."""
        asked_s = self._clock.now_s()
        volts = self._task.read().T
        numbers = self._taken + np.arange(len(volts), dtype=np.int64)
        self._taken += len(volts)
        now_s = self._clock.now_s()
        good = np.all(np.abs(volts) < self.settings.options.range_v, axis=1)
        codes = np.rint(volts / STEP_V).astype(np.int64)
        return self._readings.add(numbers, codes, good, (now_s, now_s, now_s - asked_s + TRANSFER_S))

    def _discard(self) -> None:
        self._available()
        self._readings.drop()

    def _silent(self) -> NoReply:
        return NoReply(self.name, f"no scan from {self.settings.address} for {SILENCE_S:g} s; check its sample clock")


DRIVER = GyroDriver(
    NidaqSettings,
    NidaqGyro,
    Trial(
        section={
            "host": "sim://nidaq/fog",
            "sample_rate_hz": 1000,
            "options": {"average": 10, "thermometer_input": 2},
        }
    ),
)
