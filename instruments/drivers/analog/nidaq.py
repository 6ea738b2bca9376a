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
from instruments.drivers.analog.buffered_gyro import BufferedGyro, BufferTiming
from instruments.drivers.driver import GyroDriver, Trial
from instruments.errors import LinkError, NoReply, one_line
from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.nidaqmx.service import INSTALL, INSTALL_GRPC
from instruments.transport.factory import Ports
from instruments.transport.rpc import RpcChannel
from instruments.transport.scan_means import Counts

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

    def product_of_device(self) -> str:
        """Return the model of the device, where it is known, and the name that the driver software gives it."""
        try:
            product = str(self._task.devices[0].product_type)
        except Exception:  # noqa: BLE001  a name is no reason to fail
            product = ""
        return f"{product or 'NI-DAQ'} {self._settings.device}"

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


#: What to check where no scan comes.
SILENT_CHECK = "its sample clock"
#: A scan is in the buffer of the computer within this time, s.
TRANSFER_S = 0.02


class _TaskScans:
    """The scans of a task, numbered from its start."""

    def __init__(self, task: NidaqmxTask) -> None:
        self._task = task
        self._taken = 0  #: scans that were read

    @property
    def is_open(self) -> bool:
        """Whether the inputs are scanned."""
        return self._task.is_open

    def open(self) -> float:
        """Begin to scan; returns the scans per second that the device makes. Raises LinkError."""
        self._taken = 0
        return self._task.open()

    def product(self) -> str:
        """Return the model and name of the device."""
        return self._task.product_of_device()

    def take(self) -> tuple[Counts, NDArray[np.float64]]:
        """Return the scans that the buffer holds: numbers (n,) and volts (n, inputs). Raises LinkError."""
        volts = self._task.read().T
        numbers = self._taken + np.arange(len(volts), dtype=np.int64)
        self._taken += len(volts)
        return numbers, volts

    def close(self) -> None:
        """End the scans; safe to call twice. Raises LinkError."""
        self._task.close()


class NidaqGyro(BufferedGyro):
    """Driver of analog gyros on one device. Every error of nidaqmx becomes a LinkError in one line."""

    def __init__(self, settings: NidaqSettings, ports: Ports, clock: Clock) -> None:
        self._task = NidaqmxTask(settings, ports)
        timing = BufferTiming(TRANSFER_S, SILENT_CHECK)
        super().__init__(settings, settings.address, _TaskScans(self._task), clock, timing)


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
