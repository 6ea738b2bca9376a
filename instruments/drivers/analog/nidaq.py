"""Analog gyros on a device of National Instruments, through the package nidaqmx (optional extra `nidaq`).

The hardware's own clock paces the scans, and the driver software of National Instruments buffers them. Not tried on
hardware: the tests put a module with the same calls in the place of nidaqmx.
"""

from __future__ import annotations

import contextlib
import importlib
from typing import Any

import numpy as np

from instruments.clock import Clock
from instruments.drivers.analog.analog_readings import AnalogReadings, analog_channels, analog_identity, limits_of
from instruments.drivers.driver import GyroDriver
from instruments.errors import LinkError, NoReply, WrongInstrument, one_line
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from instruments.protocols.analog_settings import NidaqSettings
from instruments.transport.factory import Ports

PACKAGE = "nidaqmx"
#: A raw value is the sum of voltages in whole steps of this, V: finer than any converter of the kind.
STEP_V = 1e-7
#: The buffer holds this many seconds of scans.
BUFFER_S = 30.0
SILENCE_S = 2.0
LOOK_EVERY_S = 0.1
RATE_TOLERANCE = 0.01
#: A scan is in the buffer of the computer within this time, s.
TRANSFER_S = 0.02
#: Name in a bench file -> constant of nidaqmx.
TERMINALS = {"default": "DEFAULT", "rse": "RSE", "nrse": "NRSE", "differential": "DIFF"}


class NidaqGyro:
    """Driver of analog gyros on one device. Every error of nidaqmx becomes a LinkError in one line."""

    def __init__(self, settings: NidaqSettings, ports: Ports, clock: Clock) -> None:
        del ports  # the driver software of the maker has the device
        self.name, self.settings = settings.name, settings
        self.axes: tuple[str, ...] = settings.axes
        self.limits = limits_of(settings)
        self.sample_rate_hz = settings.scans_per_s / settings.options.average
        self._clock, self._inputs = clock, settings.options.all_inputs
        self._readings = AnalogReadings(settings, settings.device)
        self._task: Any = None
        self._taken = 0  #: scans that were read
        self._last_s = 0.0

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the voltages, in whole steps of 0.1 microvolt."""
        return analog_channels(self.settings, [(STEP_V, 0.0)] * len(self._inputs))

    def identify(self) -> GyroIdentity:
        """Get the unit's identity by the bench file, after one reading came; raises LinkError, NoReply."""
        was_open = self._task is not None
        self.start()
        said = {"inputs": f"{self._product()} {self.settings.device}".strip()}
        self.read_latest()
        if not was_open:
            self.stop()
        return analog_identity(self.settings, f"analog gyro on {said['inputs']}", said)

    def start(self) -> None:
        """Control the scans: begin; those that run go on. Raises LinkError, WrongInstrument for another rate."""
        if self._task is not None:
            self._discard()
            return
        nidaqmx = self._module()
        try:
            self._task = nidaqmx.Task()
            self._configure(nidaqmx)
            self._task.start()
            found = float(self._task.timing.samp_clk_rate)
        except Exception as error:
            raise self._failed("start the scans", error) from error
        wanted = self.settings.scans_per_s
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
        task, self._task = self._task, None
        if task is not None:
            try:
                task.close()
            except Exception as error:
                raise self._failed("end the scans", error) from error

    def _module(self) -> Any:
        try:
            return importlib.import_module(PACKAGE)
        except ImportError as error:
            raise LinkError(
                self.name, f"the package {PACKAGE} is not installed; run `pip install labctl[nidaq]`"
            ) from error

    def _configure(self, nidaqmx: Any) -> None:
        options, constants = self.settings.options, nidaqmx.constants
        terminals = "differential" if options.differential else self.settings.terminals
        for number in self._inputs:
            self._task.ai_channels.add_ai_voltage_chan(
                f"{self.settings.device}/ai{number}",
                terminal_config=getattr(constants.TerminalConfiguration, TERMINALS[terminals]),
                min_val=-options.range_v,
                max_val=options.range_v,
            )
        self._task.timing.cfg_samp_clk_timing(
            self.settings.scans_per_s,
            sample_mode=constants.AcquisitionType.CONTINUOUS,
            samps_per_chan=round(BUFFER_S * self.settings.scans_per_s),
        )

    def _product(self) -> str:
        try:
            return str(self._task.devices[0].product_type)
        except Exception:  # noqa: BLE001  a name is no reason to fail
            return "NI-DAQ"

    def _available(self) -> Readings:
        """Return the readings of all scans that the buffer holds."""
        if self._task is None:
            raise LinkError(self.name, f"the scans of {self.settings.device} were not started; start them first")
        try:
            found = np.asarray(self._task.read(number_of_samples_per_channel=-1, timeout=0.0), dtype=np.float64)
        except Exception as error:
            raise self._failed("read the scans", error) from error
        volts = found.reshape(len(self._inputs), -1).T
        numbers = self._taken + np.arange(len(volts), dtype=np.int64)
        self._taken += len(volts)
        now_s = self._clock.now_s()
        good = np.all(np.abs(volts) < self.settings.options.range_v, axis=1)
        codes = np.rint(volts / STEP_V).astype(np.int64)
        return self._readings.add(numbers, codes, good, (now_s, now_s, TRANSFER_S))

    def _discard(self) -> None:
        self._available()
        self._readings.drop()

    def _failed(self, what: str, error: Exception) -> LinkError:
        """Return an error of nidaqmx as one line; the scans must be started again.

        A buffer that ran over (error -200279) is one of them: the number of scans that are missing is not known, so the
        data set is taken again.
        """
        task, self._task = self._task, None
        if task is not None:
            with contextlib.suppress(Exception):  # the first error is the one to report
                task.close()
        code = getattr(error, "error_code", None)
        text = f"error {code}: {one_line(error)}" if code is not None else one_line(error)
        return LinkError(
            self.name, f"cannot {what} of {self.settings.device} ({text}); check device name, cable and driver software"
        )

    def _silent(self) -> NoReply:
        return NoReply(self.name, f"no scan from {self.settings.device} for {SILENCE_S:g} s; check its sample clock")


DRIVER = GyroDriver(NidaqSettings, NidaqGyro)
