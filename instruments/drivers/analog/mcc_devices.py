"""One device of Measurement Computing: by the package uldaq, or a simulated one that gets the same calls as messages.

uldaq calls the C library in this process, so a simulated device cannot stand behind it. Both classes have the calls
that the driver makes, and raise what has `error_code` and `error_message`, as uldaq's own exception has.
"""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from instruments.protocols import uldaq_calls as calls
from instruments.protocols.analog_settings import MccSettings
from instruments.protocols.uldaq_calls import CallFailed, Scan
from instruments.protocols.uldaq_library import (
    CONTINUOUS,
    INSTALL,
    INSTALL_LIBRARY,
    LIBRARY,
    LIBRARY_SOURCE,
    PACKAGE,
    SCALED,
    Interface,
    ScanStatus,
)
from instruments.transport.factory import Ports
from instruments.transport.rpc import RpcChannel

#: An Ethernet device is found within this time, and a simulated one answers within it, s.
REPLY_S = 5.0


@dataclass(frozen=True)
class Opened:
    """What a connected device says of itself."""

    product: str  #: model and unique ID
    inputs: int  #: with the wiring of the bench file
    ranges: tuple[int, ...]  #: numbers of its ranges


class ScanDevice(Protocol):
    """The calls that the driver makes."""

    def connect(self, mode: int) -> Opened:
        """Connect to the device, and ask what it has in an input mode."""
        ...

    def start(self, scan: Scan) -> float:
        """Begin to scan without end; returns the scans per second that the device makes."""
        ...

    def status(self) -> tuple[bool, int]:
        """Return whether the inputs are scanned, and how many scans were made since the begin."""
        ...

    def part(self, first: int, count: int) -> NDArray[np.float64]:
        """Return volts (count, inputs) of the circular buffer from place `first`."""
        ...

    def close(self) -> None:
        """End the scan and the connection; safe to call twice."""
        ...


class NotInstalled(Exception):
    """The package or its C library is not installed."""


class NotFound(Exception):
    """No connected device, or more than one, is what the bench file means."""


class Unsuitable(Exception):
    """The device cannot scan by its own clock."""


class UldaqDevice:
    """A device through the package uldaq, which is imported when this is made: later nothing is imported."""

    def __init__(self, settings: MccSettings) -> None:
        self._settings = settings
        self._uldaq: Any = None
        self._missing: Exception | None = None
        self._device: Any = None
        self._inputs: Any = None
        self._buffer: Any = None  #: kept while the library writes into it
        self._volts: NDArray[np.float64] = np.zeros((0, 1))
        try:
            self._uldaq = importlib.import_module(PACKAGE)
        except Exception as error:  # noqa: BLE001  raised at the first use: the other instruments can be used
            self._missing = error

    def connect(self, mode: int) -> Opened:
        """Connect to the device. Raises NotInstalled, NotFound, Unsuitable, and what uldaq raises."""
        if self._missing is not None:
            raise _not_installed(self._missing) from self._missing
        descriptor = self._descriptor()
        product = f"{descriptor.product_name} {descriptor.unique_id}".strip()
        self._device = self._uldaq.DaqDevice(descriptor)
        self._device.connect()
        self._inputs = self._device.get_ai_device()
        if self._inputs is None:
            raise Unsuitable(f"{product} has no analog inputs; check device")
        info = self._inputs.get_info()
        if not info.has_pacer():
            raise Unsuitable(f"{product} has no clock of its own for scans; use another device")
        wiring = self._uldaq.AiInputMode(mode)
        ranges = tuple(int(each) for each in info.get_ranges(wiring))
        return Opened(product, info.get_num_chans_by_mode(wiring), ranges)

    def start(self, scan: Scan) -> float:
        """Begin to scan; returns the scans per second. Raises what uldaq raises."""
        self._buffer = self._uldaq.create_float_buffer(scan.inputs, scan.samples)
        self._volts = np.frombuffer(self._buffer, dtype=np.float64).reshape(scan.samples, scan.inputs)
        rate_hz = self._inputs.a_in_scan(
            scan.low,
            scan.high,
            scan.mode,
            scan.range_code,
            scan.samples,
            scan.rate_hz,
            CONTINUOUS,
            SCALED,
            self._buffer,
        )
        return float(rate_hz)

    def status(self) -> tuple[bool, int]:
        """Return whether the inputs are scanned, and the scans since the begin. Raises what uldaq raises."""
        status, transfer = self._inputs.get_scan_status()
        return int(status) == ScanStatus.RUNNING, int(transfer.current_scan_count)

    def part(self, first: int, count: int) -> NDArray[np.float64]:
        """Return volts (count, inputs) of the circular buffer from place `first`."""
        return self._volts[first : first + count].copy()

    def close(self) -> None:
        """End the scan and the connection; safe to call twice. Raises what uldaq raises where it cannot release."""
        inputs, self._inputs = self._inputs, None
        device, self._device = self._device, None
        if device is None:
            return
        with contextlib.suppress(Exception):  # without a scan, or unplugged
            if inputs is not None:
                inputs.scan_stop()
        with contextlib.suppress(Exception):
            device.disconnect()
        device.release()
        self._buffer, self._volts = None, np.zeros((0, 1))  # after the end: the library writes into it

    def _descriptor(self) -> Any:
        """Return the descriptor of the device that the bench file means; raises NotFound."""
        settings, uldaq = self._settings, self._uldaq
        if settings.host is not None:
            return uldaq.get_net_daq_device_descriptor(settings.host, settings.tcp_port, None, REPLY_S)
        inventory = uldaq.get_daq_device_inventory(uldaq.InterfaceType(Interface.USB))
        names = ", ".join(f"{each.product_name} {each.unique_id}" for each in inventory) or "none"
        if settings.device:
            meant = [each for each in inventory if settings.device in (each.unique_id, each.product_name)]
        else:
            meant = list(inventory)
        if not meant:
            wanted = settings.device or "of Measurement Computing"
            raise NotFound(
                f"no USB device {wanted} is connected (found: {names}); check cable, power and permission, and "
                "device in the bench file"
            )
        if len(meant) > 1:
            raise NotFound(f"{len(meant)} USB devices fit ({names}); give the unique ID of one as device")
        return meant[0]


def _not_installed(error: Exception) -> NotInstalled:
    """Return what is missing, and how it is installed."""
    if isinstance(error, ImportError) and error.name in (None, PACKAGE):
        return NotInstalled(f"the package {PACKAGE} is not installed; run `{INSTALL}`")
    return NotInstalled(
        f"the package {PACKAGE} cannot load the C library {LIBRARY} of Measurement Computing ({error}); install the "
        f"library from {LIBRARY_SOURCE} with `{INSTALL_LIBRARY}`"
    )


class CalledDevice:
    """A simulated device, which gets the calls as messages over a channel."""

    def __init__(self, settings: MccSettings, host: str, ports: Ports) -> None:
        self._settings, self._host, self._ports = settings, host, ports
        self._channel: RpcChannel | None = None
        self._scanned = 1

    def connect(self, mode: int) -> Opened:
        """Connect to the device. Raises CallFailed, and what the channel raises."""
        settings = self._settings
        self._channel = self._ports.rpc_channel(self._host, settings.tcp_port, device=settings.name, timeout_s=REPLY_S)
        product = self._call(calls.CONNECT, b"").decode("utf-8")
        inputs, *ranges = np.frombuffer(self._call(calls.INFO, bytes([mode])), dtype="<i4").tolist()
        return Opened(product, inputs, tuple(ranges))

    def start(self, scan: Scan) -> float:
        """Begin to scan; returns the scans per second. Raises CallFailed, and what the channel raises."""
        self._scanned = scan.inputs
        return float(calls.parsed_volts(self._call(calls.SCAN, calls.scan_request(scan)))[0])

    def status(self) -> tuple[bool, int]:
        """Return whether the inputs are scanned, and the scans since the begin. Raises CallFailed."""
        status, scans = calls.parsed_status(self._call(calls.STATUS, b""))
        return status == ScanStatus.RUNNING, scans

    def part(self, first: int, count: int) -> NDArray[np.float64]:
        """Return volts (count, inputs) of the circular buffer from place `first`. Raises CallFailed."""
        content = self._call(calls.BUFFER, calls.part_request(first, count))
        return calls.parsed_volts(content).reshape(-1, self._scanned)

    def close(self) -> None:
        """End the scan and the channel; safe to call twice. Raises CallFailed, and what the channel raises."""
        channel = self._channel
        if channel is None:
            return
        try:
            self._call(calls.STOP, b"")
        finally:
            channel.close()
            self._channel = None

    def _call(self, name: str, message: bytes) -> bytes:
        """Return the content of the reply to a call."""
        assert self._channel is not None
        call: Callable[..., Any] = self._channel.unary_unary(f"/{calls.SERVICE}/{name}", bytes, bytes)
        try:
            error, content = calls.parsed_reply(call(message))
        except Exception as failure:
            channel, self._channel = self._channel, None  # a device that does not answer is not asked again
            channel.close()
            raise TimeoutError(str(failure)) from failure
        if error:
            raise CallFailed(error, content.decode("utf-8"))
        return content
