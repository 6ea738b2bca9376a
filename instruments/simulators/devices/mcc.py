"""A device of Measurement Computing with analog inputs behind the maker's library, as far as a scan without end."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import part_of
from instruments.protocols import uldaq_calls as calls
from instruments.protocols.analog_settings import MccSettings
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.uldaq_calls import Scan
from instruments.protocols.uldaq_library import BIPOLAR_RANGES, TEXTS, InputMode, ScanStatus, UlError
from instruments.simulators.links.rpc_blocks import Call, Reply
from instruments.simulators.links.rpc_device import RpcDevice
from instruments.simulators.setup import InstrumentSetup

#: The clock of the device divides this, Hz.
TIMEBASE_HZ = 64e6
#: Codes of the converter over its whole range.
CODES = 65536
#: Largest voltages of its ranges.
RANGES_V = (10.0, 5.0, 2.0, 1.0)


class SimulatedMcc(RpcDevice):
    """A USB-1608G. `failure` is the error of every later question for the scan, which then has ended.

    `volts` holds the constant voltage of inputs that a test sets; `clock_ppm` is the error of the clock.
    """

    def __init__(self, setup: InstrumentSetup) -> None:
        super().__init__(setup.faults)
        self._options, self._unit = part_of(setup.gyro, MccSettings).options, setup.unit
        self.product = "USB-1608G 01E3A2B4"
        self.inputs = {InputMode.DIFFERENTIAL: 8, InputMode.SINGLE_ENDED: 16}
        self.volts: dict[int, float] = {}
        self.rate_hz: float | None = None  #: in place of the nearest that its clock can make
        self.clock_ppm = setup.unit.truth.sample_clock_ppm
        self.failure = UlError.NO_ERROR
        self.scan: Scan | None = None
        self._made_hz = 0.0
        self._started_s = 0.0
        self._filled = 0  #: scans in the buffer, also those that were overwritten
        self._buffer: NDArray[np.float64] = np.zeros((0, 1))
        self._methods: dict[str, Callable[[bytes, float], bytes]] = {
            calls.CONNECT: self._connect,
            calls.INFO: self._info,
            calls.SCAN: self._begin,
            calls.STATUS: self._status,
            calls.BUFFER: self._part,
            calls.STOP: self._stop,
        }

    def answer(self, call: Call, t_s: float) -> Reply:
        """Return the reply to a call; one of an unknown name fails."""
        method = self._methods.get(call.path.removeprefix(f"/{calls.SERVICE}/"))
        if method is None:
            return Reply(None, RpcStatus.UNIMPLEMENTED, f"{call.path} is not simulated")
        try:
            return Reply(method(call.message, t_s))
        except struct.error as error:
            return Reply(None, RpcStatus.INVALID_ARGUMENT, str(error))

    def _connect(self, _message: bytes, _t_s: float) -> bytes:
        self.scan = None  # the library stops a device before it uses it
        return calls.reply(UlError.NO_ERROR, self.product.encode("utf-8"))

    def _info(self, message: bytes, _t_s: float) -> bytes:
        numbers = [self.inputs[InputMode(message[0])], *(BIPOLAR_RANGES[range_v] for range_v in RANGES_V)]
        return calls.reply(UlError.NO_ERROR, np.array(numbers, dtype="<i4").tobytes())

    def _begin(self, message: bytes, t_s: float) -> bytes:
        if self.scan is not None:
            return _refused(UlError.ALREADY_ACTIVE)
        scan = calls.parsed_scan(message)
        if not 0 <= scan.low <= scan.high < self.inputs[InputMode(scan.mode)]:
            return _refused(UlError.BAD_AI_CHAN)
        if scan.range_code not in [BIPOLAR_RANGES[range_v] for range_v in RANGES_V]:
            return _refused(UlError.BAD_RANGE)
        self.scan, self._started_s, self._filled = scan, t_s, 0
        self._buffer = np.zeros((scan.samples, scan.inputs))
        self._made_hz = self.rate_hz or TIMEBASE_HZ / round(TIMEBASE_HZ / scan.rate_hz)
        return calls.reply(UlError.NO_ERROR, calls.volts_content(np.array([self._made_hz])))

    def _status(self, _message: bytes, t_s: float) -> bytes:
        if self.failure:
            self.scan = None
            return _refused(self.failure)
        if self.scan is None:
            return calls.reply(UlError.NO_ERROR, calls.status_content(ScanStatus.IDLE, self._filled))
        self._fill(self.scan, t_s)
        return calls.reply(UlError.NO_ERROR, calls.status_content(ScanStatus.RUNNING, self._filled))

    def _part(self, message: bytes, _t_s: float) -> bytes:
        first, count = calls.parsed_part(message)
        return calls.reply(UlError.NO_ERROR, calls.volts_content(self._buffer[first : first + count].ravel()))

    def _stop(self, _message: bytes, _t_s: float) -> bytes:
        self.scan = None
        return calls.reply(UlError.NO_ERROR)

    def _fill(self, scan: Scan, t_s: float) -> None:
        """Write the scans up to `t_s` into the buffer; of those that would be overwritten at once, none."""
        true_hz = self._made_hz * (1.0 + 1e-6 * self.clock_ppm)
        made = int(np.floor((t_s - self._started_s) * true_hz + 1e-6))
        numbers = np.arange(max(self._filled, made - scan.samples), made)
        self._filled = max(made, self._filled)
        if len(numbers):
            times = self._started_s + (numbers + 1) / true_hz
            self._buffer[numbers % scan.samples] = self._sampled(scan, times)

    def _sampled(self, scan: Scan, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts (n, inputs) of a scan's inputs at rising times (n,) s, in steps of the converter."""
        options, sample = self._options, self._unit.sample(t_s)
        rates_v = options.rest_v + options.v_per_dps * sample.rate_dps
        volts = np.zeros((len(t_s), scan.inputs))
        for column, number in enumerate(range(scan.low, scan.high + 1)):
            if number in self.volts:
                volts[:, column] = self.volts[number]
            elif number in options.inputs:
                volts[:, column] = rates_v[:, options.inputs.index(number)]
            elif number == options.thermometer_input:
                warm_c = sample.temperature_c[:, 0] - options.thermometer_zero_c
                volts[:, column] = warm_c / options.thermometer_c_per_v
        range_v = next(each for each in RANGES_V if BIPOLAR_RANGES[each] == scan.range_code)
        step_v = 2 * range_v / CODES
        return np.clip(np.rint(volts / step_v) * step_v, -range_v, range_v - step_v)


def _refused(error: UlError) -> bytes:
    return calls.reply(error, TEXTS[error].encode("utf-8"))
