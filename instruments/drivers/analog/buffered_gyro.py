"""Analog gyros on inputs that a maker's library scans into a buffer, from which all scans are taken at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.drivers.analog.analog_readings import (
    AnalogReadings,
    Scans,
    analog_channels,
    analog_identity,
    limits_of,
)
from instruments.errors import NoReply, WrongInstrument
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from instruments.protocols.analog_settings import AnalogSettings
from instruments.transport.scan_means import Counts

#: A raw value is the sum of voltages in whole steps of this, V: finer than any converter of the kind.
STEP_V = 1e-7
SILENCE_S = 2.0
#: Longest pause between two reads of the buffer while a fresh reading is awaited, s.
POLL_EVERY_S = 0.1
RATE_TOLERANCE = 0.01


class ScanBuffer(Protocol):
    """The buffer of one device. Every error is a LinkError in one line, and ends the scans."""

    @property
    def is_open(self) -> bool:
        """Whether the inputs are scanned."""
        ...

    def open(self) -> float:
        """Begin to scan; returns the scans per second that the device makes. Raises LinkError, LimitError."""
        ...

    def product(self) -> str:
        """Return the model and name of the device."""
        ...

    def take(self) -> tuple[Counts, NDArray[np.float64]]:
        """Return new scans: numbers (n,), rising, with a gap where scans are missing, and volts (n, inputs)."""
        ...

    def close(self) -> None:
        """End the scans; safe to call twice. Raises LinkError."""
        ...


@dataclass(frozen=True)
class BufferTiming:
    """How fast scans come into the buffer, and what to check where none comes.

    A voltage is valid below the share `valid_share` of the range.
    """

    transfer_s: float  #: a scan is in the buffer within this time
    check: str
    valid_share: float = 1.0


class BufferedGyro:
    """Driver of analog gyros on one device. A reading's time is by the number of its last scan."""

    def __init__(
        self, settings: AnalogSettings, address: str, buffer: ScanBuffer, clock: Clock, timing: BufferTiming
    ) -> None:
        self.name, self.settings = settings.name, settings
        self.axes: tuple[str, ...] = settings.axes
        self.limits = limits_of(settings)
        self.sample_rate_hz = settings.scans_per_s / settings.options.average
        self._clock, self._address = clock, address
        self._readings = AnalogReadings(settings, address)
        self._buffer, self._timing = buffer, timing
        self._last_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the voltages, in whole steps of 0.1 microvolt."""
        return analog_channels(self.settings, [(STEP_V, 0.0)] * len(self.settings.options.all_inputs))

    def identify(self) -> GyroIdentity:
        """Get the unit's identity by the bench file, after one reading came; raises LinkError, NoReply."""
        was_open = self._buffer.is_open
        self.start()
        reported = {"inputs": self._buffer.product()}
        self.read_latest()
        if not was_open:
            self.stop()
        return analog_identity(self.settings, f"analog gyro on {reported['inputs']}", reported)

    def start(self) -> None:
        """Start the scans; those that run go on. Raises LinkError, WrongInstrument for another rate."""
        if self._buffer.is_open:
            self._discard()
            return
        scan_rate_hz, requested_hz = self._buffer.open(), self.settings.scans_per_s
        if abs(scan_rate_hz / requested_hz - 1.0) > RATE_TOLERANCE:
            self.stop()
            raise WrongInstrument(
                self.name,
                f"scans {scan_rate_hz:g} times per second, but the bench file states {requested_hz:g}; set "
                f"sample_rate_hz = {scan_rate_hz:g}",
            )
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
            self._clock.sleep(min(POLL_EVERY_S, 0.5 / self.sample_rate_hz))
            if len(readings := self._available()):
                self._last_s = self._clock.now_s()
                return readings.newest()
        raise self._silent()

    def stop(self) -> None:
        """Stop the scans; safe to call twice, and where the library fails."""
        self._buffer.close()

    def _available(self) -> Readings:
        """Return the readings of all scans that the buffer holds."""
        asked_s = self._clock.now_s()
        numbers, volts = self._buffer.take()
        now_s = self._clock.now_s()
        limit_v = self._timing.valid_share * self.settings.options.range_v
        good = np.all(np.abs(volts) < limit_v, axis=1)
        codes = np.rint(volts / STEP_V).astype(np.int64)
        scans = Scans(numbers, codes, good, np.full(len(volts), now_s))
        return self._readings.add(scans, (now_s, now_s, now_s - asked_s + self._timing.transfer_s))

    def _discard(self) -> None:
        self._available()
        self._readings.drop()

    def _silent(self) -> NoReply:
        return NoReply(self.name, f"no scan from {self._address} for {SILENCE_S:g} s; check {self._timing.check}")
