"""Analog gyros on a device of Measurement Computing, through the maker's package uldaq (optional extra `mcc`).

The device's own clock paces the scans, and the maker's C library writes them into a circular buffer. Not tried on
hardware: tests drive the package on a stand-in of the C library, and the driver on a simulated device.
"""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import is_simulated_address
from instruments.clock import Clock
from instruments.drivers.analog.buffered_gyro import BufferedGyro, BufferTiming
from instruments.drivers.analog.mcc_devices import (
    CalledDevice,
    NotFound,
    NotInstalled,
    Opened,
    ScanDevice,
    UldaqDevice,
    Unsuitable,
)
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import InstrumentError, LimitError, LinkError, NoReply, WrongInstrument, one_line
from instruments.protocols.analog_settings import MccSettings
from instruments.protocols.uldaq_calls import Scan
from instruments.protocols.uldaq_library import BIPOLAR_RANGES, InputMode, UlError
from instruments.transport.factory import Ports
from instruments.transport.scan_means import Counts

#: The buffer holds this many seconds of scans; those of the last second before it is full may be overwritten.
BUFFER_S, MARGIN_S = 30.0, 1.0
#: At least so many scans.
MIN_BUFFER = 100
#: The library passes on samples by blocks of so many bytes, or of so many seconds where these are more.
BLOCK_BYTES, BLOCK_S = 512, 0.02
MIN_SAMPLE_BYTES = 2
#: The calibration of a device moves the ends of a range: a voltage this near to them, as a share, may be cut off.
VALID_SHARE = 0.99
#: What to check after an error number; after any other, CHECK.
CHECKS: dict[int, str] = {
    UlError.USB_DEV_NO_PERMISSION: "that the maker's udev rules are installed (rules/50-uldaq.rules of libuldaq)",
    UlError.USB_INTERFACE_CLAIMED: "that no other program uses the device",
    UlError.OVERRUN: "whether a lower sample_rate_hz or fewer inputs will do",
}
CHECK = "device, cable and power"


class MccScans:
    """The scans of one device. Every error of the library becomes a LinkError in one line, and ends the scans."""

    def __init__(self, settings: MccSettings, device: ScanDevice) -> None:
        self.name, self._settings, self._device = settings.name, settings, device
        options = settings.options
        low, high = min(options.all_inputs), max(options.all_inputs)
        self._columns = [number - low for number in options.all_inputs]
        mode = InputMode.DIFFERENTIAL if options.differential else InputMode.SINGLE_ENDED
        samples = max(round(BUFFER_S * settings.scans_per_s), MIN_BUFFER)
        code = BIPOLAR_RANGES.get(options.range_v, 0)
        self.scan = Scan(low, high, mode, code, samples, settings.scans_per_s)
        self._margin = min(round(MARGIN_S * settings.scans_per_s), samples // 2)
        self._taken = 0  #: number of the next scan
        self._opened: Opened | None = None

    @property
    def is_open(self) -> bool:
        """Whether the inputs are scanned."""
        return self._opened is not None

    def open(self) -> float:
        """Begin to scan; returns the scans per second that the device makes.

        Raises LinkError, LimitError for inputs or a range that it does not have, WrongInstrument.
        """
        try:
            self._opened = opened = self._device.connect(self.scan.mode)
            self._require(opened)
            self._taken = 0
            return self._device.start(self.scan)
        except Exception as error:
            raise self._failed("start the scans", error) from error

    def product(self) -> str:
        """Return the model of the device, and its unique ID."""
        return "" if self._opened is None else self._opened.product

    def take(self) -> tuple[Counts, NDArray[np.float64]]:
        """Return new scans: numbers (n,) and volts (n, inputs); those that were overwritten leave a gap."""
        if self._opened is None:
            raise LinkError(self.name, f"the scans of {self._settings.address} were not started; start them first")
        try:
            total = self._total()
            first = max(self._taken, self._oldest(total))
            volts = self._copied(first, total)
            if total - first > self.scan.samples // 2:  # a reader so far behind may be overtaken while it copies
                oldest = min(self._oldest(self._total()), total)
                volts, first = volts[max(oldest - first, 0) :], max(oldest, first)
        except Exception as error:
            raise self._failed("read the scans", error) from error
        self._taken = total
        return np.arange(first, total, dtype=np.int64), volts[:, self._columns]

    def close(self) -> None:
        """End the scans; safe to call twice, and where the device does not answer."""
        self._opened = None
        with contextlib.suppress(Exception):  # what is wrong with the device is reported at its next use
            self._device.close()

    def _total(self) -> int:
        """Return how many scans were made since the begin; raises LinkError where no more come."""
        is_running, total = self._device.status()
        if not is_running:
            raise LinkError(
                self.name,
                f"{self._settings.address} has ended its scans after {total} of them; check that no other program "
                "uses the device",
            )
        return total

    def _oldest(self, total: int) -> int:
        """Return the number of the oldest scan that is not overwritten once `total` were made."""
        return max(total - self.scan.samples + self._margin, 0)

    def _copied(self, first: int, total: int) -> NDArray[np.float64]:
        """Return the volts (n, scanned inputs) of the scans from `first` up to `total`."""
        place = first % self.scan.samples
        count = total - first
        until_end = min(count, self.scan.samples - place)
        parts = [self._device.part(place, until_end)]
        if count > until_end:
            parts.append(self._device.part(0, count - until_end))
        return np.concatenate(parts)

    def _require(self, opened: Opened) -> None:
        """Raise LimitError for inputs or a range that the device does not have."""
        options, device = self._settings.options, opened.product
        wiring = "differential" if options.differential else "single-ended"
        if self.scan.high >= opened.inputs:
            raise LimitError(
                self.name,
                f"input {self.scan.high} is not one of the {opened.inputs} {wiring} inputs of {device} (from 0 on); "
                "correct options.inputs in the bench file",
            )
        if self.scan.range_code not in opened.ranges:
            has = ", ".join(f"{v:g}" for v, code in sorted(BIPOLAR_RANGES.items()) if code in opened.ranges)
            raise LimitError(
                self.name,
                f"range_v {options.range_v:g} V is not a range of the {wiring} inputs of {device}; choose one of "
                f"{has} as options.range_v in the bench file",
            )

    def _failed(self, purpose: str, error: Exception) -> InstrumentError:
        """Return an error of the library as one line; the scans must be started again.

        A full memory of the device (error 18) is one of them: the number of scans that are missing is not known, so the
        data set is taken again.
        """
        self.close()
        if isinstance(error, InstrumentError):
            return error
        if isinstance(error, TimeoutError):
            return NoReply(
                self.name, f"cannot {purpose} of {self._settings.address}: no answer ({error}); check {CHECK}"
            )
        if isinstance(error, NotInstalled | NotFound):
            return LinkError(self.name, str(error))
        if isinstance(error, Unsuitable):
            return WrongInstrument(self.name, str(error))
        number = int(getattr(error, "error_code", UlError.NO_ERROR))
        text = f"error {number}: {getattr(error, 'error_message', '')}" if number else one_line(error)
        return LinkError(
            self.name, f"cannot {purpose} of {self._settings.address} ({text}); check {CHECKS.get(number, CHECK)}"
        )


class MccGyro(BufferedGyro):
    """Driver of analog gyros on one device."""

    def __init__(self, settings: MccSettings, ports: Ports, clock: Clock) -> None:
        host = settings.host
        if host is not None and is_simulated_address(host):
            device: ScanDevice = CalledDevice(settings, host, ports)
        else:
            device = UldaqDevice(settings)
        self._scans = MccScans(settings, device)
        samples_per_s = self._scans.scan.inputs * settings.scans_per_s
        transfer_s = max(BLOCK_S, BLOCK_BYTES / (MIN_SAMPLE_BYTES * samples_per_s))
        timing = BufferTiming(transfer_s, "cable and power", VALID_SHARE)
        super().__init__(settings, settings.address, self._scans, clock, timing)


DRIVER = GyroDriver(
    MccSettings,
    MccGyro,
    Trial(
        section={
            "host": "sim://mcc-daq/fog",
            "sample_rate_hz": 1000,
            "options": {"average": 10, "thermometer_input": 2},
        }
    ),
)
