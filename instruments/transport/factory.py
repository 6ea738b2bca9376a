"""Links of one bench by address: serial ports, Modbus and gRPC, on hardware or on simulated instruments.

An address that begins with `sim://` leads to the simulated instruments that the composition root hands in; this package
imports no simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from instruments.bench_config import is_simulated_address
from instruments.clock import Clock, wait_s
from instruments.errors import LinkError
from instruments.interfaces.unit_handler import UnitHandler
from instruments.protocols.can.address import is_can_address
from instruments.transport.adapters import require_adapter
from instruments.transport.can_port import open_can
from instruments.transport.opened_port import open_port
from instruments.transport.port_failures import reason, remedy
from instruments.transport.rpc import RpcChannel, TimedChannel
from instruments.transport.rtu import NOT_OPENED, RtuClient
from instruments.transport.serial import EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import PolledReader, StreamReader, ThreadedReader
from instruments.transport.tcp_client import TcpClient

#: A call of gRPC may take this long, s of real time: a busy computer is no silent instrument.
MIN_CALL_S = 1.0


class LinkFactory(Protocol):
    """Makes ports, clients and channels, of hardware or simulated. Time-outs are seconds of the bench clock."""

    def serial_port(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> SerialPort:
        """Return an open port with 8 data bits; raises what pyserial raises."""
        ...

    def port_timeout_s(self, timeout_s: float) -> float:
        """Return the value of a port's `timeout` attribute that stands for `timeout_s` seconds of the bench clock."""
        ...

    def tcp_client(self, host: str, tcp_port: int, *, timeout_s: float) -> ModbusTcpClient:
        """Return a Modbus TCP client that is not connected yet."""
        ...

    def rtu_client(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> ModbusSerialClient:
        """Return a Modbus RTU client, 8 data bits, that is not connected yet."""
        ...

    def rpc_channel(self, host: str, tcp_port: int, *, timeout_s: float) -> RpcChannel:
        """Return an open gRPC channel, each of whose calls ends within `timeout_s`; raises ImportError."""
        ...


class Wire(Protocol):
    """What stands between the drivers of a bench and its links: it records what passes, or answers itself."""

    @property
    def answers(self) -> bool:
        """Whether it answers itself: no instrument, real or simulated, is opened."""
        ...

    def links(self, links: LinkFactory) -> LinkFactory:
        """Return the links that the drivers use in place of `links`."""
        ...

    def stream_reader(self, url: str, port: SerialPort, make: Callable[[SerialPort], StreamReader]) -> StreamReader:
        """Return what empties an open port of these links; `make` returns what empties a port that it is given."""
        ...

    def unit_handler(self, handler: UnitHandler) -> UnitHandler:
        """Return the unit handler that is used in place of `handler`."""
        ...


class HardwareLinks:
    """Real ports and hosts. A time-out of the bench clock becomes seconds of real time."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def serial_port(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> SerialPort:
        """Return an open port, locked for this process, or a CAN bus; raises what pyserial raises."""
        if is_can_address(url):
            return open_can(url, timeout_s=wait_s(self._clock, timeout_s))
        return open_port(url, baudrate=baudrate, timeout_s=wait_s(self._clock, timeout_s), line=line)

    def port_timeout_s(self, timeout_s: float) -> float:
        """Return the seconds of real time of a time-out in seconds of the bench clock."""
        return wait_s(self._clock, timeout_s)

    def tcp_client(self, host: str, tcp_port: int, *, timeout_s: float) -> ModbusTcpClient:
        """Return a client of a real host, not connected yet."""
        return TcpClient(host, tcp_port, self._clock, timeout_s)

    def rtu_client(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> ModbusSerialClient:
        """Return a client on a real port, not connected yet."""
        return RtuClient(url, self._clock, baudrate=baudrate, timeout_s=timeout_s, line=line)

    def rpc_channel(self, host: str, tcp_port: int, *, timeout_s: float) -> RpcChannel:
        """Return an open gRPC channel to a real host, without encryption; raises ImportError without grpcio."""
        return TimedChannel(host, tcp_port, max(self._clock.wall_s(timeout_s), MIN_CALL_S))


class Ports:
    """Opens the links of one bench; `simulated` makes the links of `sim://` addresses, where the bench has any.

    `adapters`: device -> serial number of the USB adapter that each of its serial ports must be on, at every opening.
    `wire` stands between the drivers and these links, where there is one.
    """

    def __init__(
        self,
        clock: Clock,
        simulated: LinkFactory | None = None,
        adapters: Mapping[str, str] | None = None,
        wire: Wire | None = None,
    ) -> None:
        self._clock, self._wire = clock, wire
        self._adapters = dict(adapters or {})
        self._hardware: LinkFactory = HardwareLinks(clock)
        self._simulated = simulated
        if wire is not None:
            self._hardware = wire.links(self._hardware)
            if wire.answers:
                self._simulated = self._hardware
                self._adapters.clear()
            elif simulated is not None:
                self._simulated = wire.links(simulated)

    def serial(self, url: str, *, device: str, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> SerialPort:
        """Open a serial port, 8 data bits, locked for this process.

        Raises LinkError with port and remedy, also while another process has the port open, and WrongInstrument on
        another USB adapter than the bench file names.
        """
        self._require_adapter(url, device)
        try:
            return self._links(url, device).serial_port(url, baudrate=baudrate, timeout_s=timeout_s, line=line)
        except NOT_OPENED as error:
            raise LinkError(
                device, f"port {url} cannot be opened ({reason(error)}); check {remedy(url, error)}"
            ) from error

    def stream_reader(self, url: str, port: SerialPort) -> StreamReader:
        """Return what empties an open port: a thread for a real one, which does not wait for its reader."""

        def make(port: SerialPort) -> StreamReader:
            return PolledReader(port, self._clock) if is_simulated_address(url) else ThreadedReader(port, self._clock)

        return make(port) if self._wire is None else self._wire.stream_reader(url, port, make)

    def port_timeout_s(self, url: str, timeout_s: float, *, device: str) -> float:
        """Return the `timeout` of an open port that stands for `timeout_s` seconds of the bench clock."""
        return self._links(url, device).port_timeout_s(timeout_s)

    def modbus_tcp(self, host: str, tcp_port: int, *, device: str, timeout_s: float) -> ModbusTcpClient:
        """Open a Modbus TCP link; raises LinkError with host and remedy."""
        client = self._links(host, device).tcp_client(host, tcp_port, timeout_s=timeout_s)
        if not client.connect():
            raise LinkError(
                device,
                f"no Modbus TCP instrument answers at {host}:{tcp_port}; check address, cable and that "
                "the instrument is switched on",
            )
        return client

    def modbus_rtu(
        self, url: str, *, device: str, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1
    ) -> ModbusSerialClient:
        """Open a Modbus RTU link on a serial port; raises LinkError with port and remedy, and as `serial` does."""
        self._require_adapter(url, device)
        client = self._links(url, device).rtu_client(url, baudrate=baudrate, timeout_s=timeout_s, line=line)
        if not client.connect():
            error = getattr(client, "failure", None) or OSError("for no reason that is known")
            raise LinkError(
                device, f"port {url} cannot be opened ({reason(error)}); check {remedy(url, error)}"
            ) from error
        return client

    def rpc_channel(self, host: str, tcp_port: int, *, device: str, timeout_s: float) -> RpcChannel:
        """Open a gRPC channel, which connects with its first call; raises ImportError without grpcio, LinkError."""
        return self._links(host, device).rpc_channel(host, tcp_port, timeout_s=timeout_s)

    def _require_adapter(self, url: str, device: str) -> None:
        if device in self._adapters:
            require_adapter(device, url, self._adapters[device])

    def _links(self, address: str, device: str) -> LinkFactory:
        if not is_simulated_address(address):
            return self._hardware
        if self._simulated is None:
            raise LinkError(
                device,
                f"{address} is the address of a simulated instrument, but this bench is not simulated; correct "
                "the address in the bench file",
            )
        return self._simulated
