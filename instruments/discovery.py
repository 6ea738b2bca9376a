"""Which instrument is on which port or host: first listened to, then asked by requests that only read."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from pymodbus import ModbusException
from serial.tools import list_ports

from instruments.clock import Clock
from instruments.drivers.driver import ChamberDriver, GyroDriver
from instruments.drivers.probe import HostProbe, Probe, Recognised
from instruments.drivers.registry import DRIVERS, KINDS, Driver
from instruments.errors import InstrumentError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.transport.adapters import adapter_of
from instruments.transport.factory import Ports
from instruments.transport.port_failures import permission_command, stable_name, users_of
from instruments.transport.serial import BROKEN, SerialPort


@dataclass(frozen=True)
class PortInfo:
    """A serial port, as this computer knows it; nothing was sent to it."""

    device: str  #: as the system numbers it: /dev/ttyUSB0
    path: str  #: the name that a bench file should have
    adapter: str = ""  #: serial number of its USB adapter
    product: str = ""
    trouble: str = ""  #: why it cannot be used, and what to do


def port_info(path: str, product: str = "") -> PortInfo:
    """Return what is known of one port."""
    trouble = ""
    if not os.access(path, os.R_OK | os.W_OK):
        trouble = f"this user has no access to the port: {permission_command(path)}"
    elif users := users_of(path):
        trouble = f"{', '.join(users)} has the port open: end that process"
    return PortInfo(path, stable_name(path) or path, adapter_of(path), product, trouble)


def serial_ports() -> list[PortInfo]:
    """Return the serial ports that there are, in the order of their numbers."""
    return [port_info(port.device, port.product or "") for port in sorted(list_ports.comports())]


#: A port is read this often, s.
POLL_INTERVAL_S = 0.05
HOST_S = 1.0
ROOM_C = 25.0
#: Stands for a serial number while the unit is asked for its own.
UNKNOWN = "not-known"
LOST: tuple[type[Exception], ...] = (ModbusException, *BROKEN)


@dataclass(frozen=True)
class Found:
    """What is at an address: an instrument with its driver, or why none was recognised."""

    address: str
    driver: str = ""
    kind: str = ""  #: table, chamber or gyro
    recognised: Recognised | None = None
    why_not: str = ""


def find_on_port(port: str, clock: Clock) -> Found:
    """Return what is on a serial port. Nothing is sent to a port on which something comes by itself."""
    ports = Ports(clock)
    heard = 0
    try:
        for baudrate, listening in _by_rate(_probes(asking=False)):
            data = _exchange(ports, port, baudrate, b"", max(probe.wait_s for _, probe in listening), clock)
            heard += len(data)
            for name, probe in listening:
                if (identification := probe.recognise(data, baudrate)) is not None:
                    return Found(port, name, _kind(name), identification)
        if heard:
            return Found(
                port, why_not=f"{heard} bytes arrived that no driver recognises, so labctl sent nothing to this port"
            )
        for name, probe in _probes(asking=True):
            for baudrate in probe.baudrates:
                data = _exchange(ports, port, baudrate, probe.asks, probe.wait_s, clock)
                if (identification := probe.recognise(data, baudrate)) is not None:
                    return Found(port, name, _kind(name), identification)
    except InstrumentError as error:
        return Found(port, why_not=str(error).removeprefix(f"{error.device}: "))
    return Found(
        port, why_not="no instrument answers: check power and cable; a gyro must send readings without a request"
    )


def find_on_host(host: str, tcp_port: int, clock: Clock) -> Found:
    """Return which Modbus TCP instrument is at a host."""
    address = f"{host}:{tcp_port}"
    try:
        client = Ports(clock).modbus_tcp(host, tcp_port, device=address, timeout_s=HOST_S)
    except InstrumentError as error:
        return Found(address, why_not=str(error).removeprefix(f"{error.device}: "))
    try:
        for name, driver in _all().items():
            if isinstance(driver.probe, HostProbe) and (identification := driver.probe.recognise(client)) is not None:
                return Found(address, name, _kind(name), identification)
    except LOST as error:
        return Found(address, why_not=f"the link broke ({error}); check the address")
    finally:
        _closed(client)
    return Found(address, why_not="an instrument answers, but no installed driver recognises it")


def ask_itself(name: str, values: Mapping[str, object], clock: Clock) -> dict[str, object]:
    """Return keys of a bench file that an instrument reports itself: limits of a chamber, serial number of a gyro.

    `values` are the keys that are known. Empty where it reports none of them, or does not answer.
    """
    driver = _all()[str(values["driver"])]
    try:
        if isinstance(driver, ChamberDriver):
            return _limits(driver.make(driver.settings.model_validate(values), Ports(clock), clock))
        if isinstance(driver, GyroDriver):
            section = {**values, "name": name, "serial": UNKNOWN}
            return _own_serial(driver.make(driver.settings.model_validate(section), Ports(clock), clock))
    except InstrumentError:
        return {}
    return {}


def _limits(chamber: Chamber) -> dict[str, object]:
    try:
        limits = chamber.limits
    finally:
        chamber.close()
    return {"min_c": limits.min_c, "max_c": limits.max_c, "safe_c": min(max(ROOM_C, limits.min_c), limits.max_c)}


def _own_serial(gyro: Gyro) -> dict[str, object]:
    try:
        serial = gyro.identify().reported.get("serial")
    finally:
        gyro.stop()
    return {} if serial is None else {"serial": serial}


def _closed(client: object) -> None:
    close: Callable[[], None] = getattr(client, "close")  # noqa: B009  pymodbus gives it no type
    close()


def _all() -> dict[str, Driver]:
    return dict(DRIVERS.all())


def _kind(name: str) -> str:
    kind_name, _ = KINDS[type(_all()[name])]
    return kind_name


def _probes(*, asking: bool) -> list[tuple[str, Probe]]:
    probes = [(name, driver.probe) for name, driver in _all().items()]
    return [(name, probe) for name, probe in probes if isinstance(probe, Probe) and bool(probe.asks) == asking]


def _by_rate(probes: list[tuple[str, Probe]]) -> Iterator[tuple[int, list[tuple[str, Probe]]]]:
    rates = dict.fromkeys(rate for _, probe in probes for rate in probe.baudrates)
    for rate in rates:
        yield rate, [(name, probe) for name, probe in probes if rate in probe.baudrates]


def _exchange(ports: Ports, path: str, baudrate: int, asks: bytes, wait_s: float, clock: Clock) -> bytes:
    """Send a request, or nothing; returns what comes within a time. Raises InstrumentError."""
    port = ports.serial(path, device=path, baudrate=baudrate, timeout_s=wait_s)
    try:
        port.reset_input_buffer()
        if asks:
            port.write(asks)
        return _listen(port, wait_s, clock)
    except BROKEN:
        return b""
    finally:
        port.close()


def _listen(port: SerialPort, wait_s: float, clock: Clock) -> bytes:
    """Return what comes within a time, counted in looks: on a busy computer each of them takes longer."""
    data = b""
    for _ in range(math.ceil(wait_s / POLL_INTERVAL_S)):
        clock.sleep(POLL_INTERVAL_S)
        if waiting := port.in_waiting:
            data += port.read(waiting)
    return data
