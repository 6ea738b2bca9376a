"""Analog gyros on a device of National Instruments, through the package nidaqmx (optional extra `nidaq`).

The hardware's own clock paces the scans, and the driver software of National Instruments buffers them: that of this
computer, or that of another one, behind NI's gRPC device server (extra `nidaq-grpc`). Not tried on hardware: the tests
drive a simulated server through nidaqmx itself.
"""

from __future__ import annotations

import contextlib
import importlib
import re
from typing import Any

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
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import LinkError, NoReply, WrongInstrument, one_line
from instruments.interfaces.gyro import Channel, GyroIdentity, Readings
from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.nidaqmx.service import INSTALL, INSTALL_GRPC
from instruments.transport.factory import Ports
from instruments.transport.rpc import RpcChannel

PACKAGE = "nidaqmx"
#: What nidaqmx itself imports with its first task, without a server and with one.
LOCAL, REMOTE = "nidaqmx._library_interpreter", "nidaqmx._grpc_interpreter"
#: The buffer holds this many seconds of scans.
BUFFER_S = 30.0
#: Every call to a server ends within this time, s: to set up a device takes the longest.
REPLY_S = 5.0
#: Name in a bench file -> constant of nidaqmx.
TERMINALS = {"default": "DEFAULT", "rse": "RSE", "nrse": "NRSE", "differential": "DIFF"}


class NidaqmxTask:
    """One task, which scans without end. Every error of nidaqmx becomes a LinkError in one line, and ends the task.

    nidaqmx is imported when this is made: nothing is imported while a bench is in use.
    """

    def __init__(self, settings: NidaqSettings, ports: Ports) -> None:
        self.name, self._settings, self._ports = settings.name, settings, ports
        self._task: Any = None
        self._channel: RpcChannel | None = None
        self._missing: ImportError | None = None
        self._nidaqmx: Any = None
        try:
            self._nidaqmx = importlib.import_module(PACKAGE)
            _preload(LOCAL if settings.host is None else REMOTE)
        except ImportError as error:  # raised at the first use: the other instruments of a bench can be used
            self._missing = error

    @property
    def is_open(self) -> bool:
        """Whether the inputs are scanned."""
        return self._task is not None

    def open(self) -> float:
        """Begin to scan; returns the scans per second that the device makes. Raises LinkError."""
        if self._missing is not None:
            raise self._not_installed(self._missing) from self._missing
        try:
            self._task = self._made() if self._settings.host is None else self._made_at(self._settings.host)
            self._configure()
            self._task.start()
            return float(self._task.timing.samp_clk_rate)
        except Exception as error:
            raise self._failed("start the scans", error) from error

    def product(self) -> str:
        """Return the model of the device; empty where it does not tell."""
        try:
            return str(self._task.devices[0].product_type)
        except Exception:  # noqa: BLE001  a name is no reason to fail
            return ""

    def read(self) -> NDArray[np.float64]:
        """Return all scans that the buffer holds, in volts (inputs, n). Raises LinkError."""
        if self._task is None:
            raise LinkError(self.name, f"the scans of {self._settings.address} were not started; start them first")
        try:
            samples = self._task.read(number_of_samples_per_channel=-1, timeout=0.0)
        except Exception as error:
            raise self._failed("read the scans", error) from error
        return np.asarray(samples, dtype=np.float64).reshape(len(self._settings.options.all_inputs), -1)

    def close(self) -> None:
        """End the scans; safe to call twice. Raises LinkError."""
        task, self._task = self._task, None
        try:
            if task is not None:
                task.close()
        except Exception as error:
            raise self._failed("end the scans", error) from error
        finally:
            self._close_channel()

    def _made(self) -> Any:
        return self._nidaqmx.Task()

    def _made_at(self, host: str) -> Any:
        """Return a new task of a server.

        A task stays on the server when its client goes without clearing it, and keeps the device. So it has a name, and
        one of the same name, from before the link was lost, is cleared.
        """
        settings, begin = self._settings, self._nidaqmx.SessionInitializationBehavior
        name = re.sub(r"[^A-Za-z0-9]", "_", f"labctl_{settings.device}_{settings.serial}")
        self._channel = self._ports.rpc_channel(host, settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        def task(behaviour: object) -> Any:
            options = self._nidaqmx.GrpcSessionOptions(self._channel, name, initialization_behavior=behaviour)
            return self._nidaqmx.Task(name, grpc_options=options)

        try:
            return task(begin.INITIALIZE_SERVER_SESSION)
        except Exception as error:
            if _rpc_status(error) != RpcStatus.ALREADY_EXISTS:
                raise
        task(begin.ATTACH_TO_SERVER_SESSION).close()
        return task(begin.INITIALIZE_SERVER_SESSION)

    def _configure(self) -> None:
        settings, constants = self._settings, self._nidaqmx.constants
        options = settings.options
        terminals = "differential" if options.differential else settings.terminals
        for number in options.all_inputs:
            self._task.ai_channels.add_ai_voltage_chan(
                f"{settings.device}/ai{number}",
                terminal_config=getattr(constants.TerminalConfiguration, TERMINALS[terminals]),
                min_val=-options.range_v,
                max_val=options.range_v,
            )
        self._task.timing.cfg_samp_clk_timing(
            settings.scans_per_s,
            sample_mode=constants.AcquisitionType.CONTINUOUS,
            samps_per_chan=round(BUFFER_S * settings.scans_per_s),
        )

    def _not_installed(self, error: ImportError) -> LinkError:
        command = INSTALL if self._settings.host is None else INSTALL_GRPC
        if error.name in (None, PACKAGE):
            return LinkError(self.name, f"the package {PACKAGE} is not installed; run `{command}`")
        return LinkError(self.name, f"{PACKAGE} needs the module {error.name}, which is not installed; run `{command}`")

    def _failed(self, purpose: str, error: Exception) -> LinkError:
        """Return an error of nidaqmx as one line; the scans must be started again.

        A buffer that ran over (error -200279) is one of them: the number of scans that are missing is not known, so the
        data set is taken again.
        """
        task, self._task = self._task, None
        status, settings = _rpc_status(error), self._settings
        if task is not None and status is None:  # a server that does not answer is not asked to clear it
            with contextlib.suppress(Exception):  # the first error is the one to report
                task.close()
        self._close_channel()
        if isinstance(error, LinkError):
            return error
        if status in (RpcStatus.DEADLINE_EXCEEDED, RpcStatus.UNAVAILABLE):
            return NoReply(
                self.name,
                f"cannot {purpose} of {settings.address}: NI's gRPC device server does not answer ({one_line(error)}); "
                "check host, tcp_port, network, and that the server is running",
            )
        code = getattr(error, "error_code", None)
        text = f"error {code}: {one_line(error)}" if code is not None else one_line(error)
        software = "driver software" if settings.host is None else "the driver software of the server"
        return LinkError(
            self.name, f"cannot {purpose} of {settings.address} ({text}); check device name, cable and {software}"
        )

    def _close_channel(self) -> None:
        channel, self._channel = self._channel, None
        if channel is not None:
            channel.close()


def _preload(module: str) -> None:
    """Import a module of nidaqmx that it imports itself only later; one that a newer release has not is left out."""
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise


def _rpc_status(error: Exception) -> int | None:
    """Return the number of a failed call's status; None for an error of the driver software."""
    code = getattr(error, "rpc_code", None)
    return None if code is None else int(code.value[0])


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
        reported = {"inputs": f"{self._task.product() or 'NI-DAQ'} {self.settings.device}"}
        self.read_latest()
        if not was_open:
            self.stop()
        return analog_identity(self.settings, f"analog gyro on {reported['inputs']}", reported)

    def start(self) -> None:
        """Start the scans; those that run go on. Raises LinkError, WrongInstrument for another rate."""
        if self._task.is_open:
            self._discard()
            return
        scan_rate_hz, requested_hz = self._task.open(), self.settings.scans_per_s
        if abs(scan_rate_hz / requested_hz - 1.0) > RATE_TOLERANCE:
            self.stop()
            raise WrongInstrument(
                self.name,
                f"scans {scan_rate_hz:g} times per second, but the bench file states {requested_hz:g}; set "
                f"sample_rate_hz = {scan_rate_hz:g}",
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
        """Stop the scans; safe to call twice, and where nidaqmx fails."""
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
        scans = Scans(numbers, codes, good, np.full(len(volts), now_s))
        return self._readings.add(scans, (now_s, now_s, now_s - asked_s + TRANSFER_S))

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
