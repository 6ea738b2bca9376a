"""Recording a session: the links of a bench and its unit handler, with every operation in a wire log."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from instruments.clock import Clock
from instruments.interfaces.unit_handler import UnitHandler
from instruments.protocols.simulator_control import BUSY, IS_TURNING, OK, mount_line, power_line, turn_line
from instruments.transport.factory import LinkFactory
from instruments.transport.rpc.channel import RpcChannel
from instruments.transport.serial import EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import StreamReader
from instruments.transport.wire_log.document import Event, Kind
from instruments.transport.wire_log.log_file import WireLogFile
from instruments.transport.wire_log.recorded_clients import RecordedChannel, recorded_rtu, recorded_tcp
from instruments.transport.wire_log.recorded_port import Note, RecordedPort, RecordedReader, noted

#: The port of a log that stands for who turns and switches the units.
UNIT_HANDLER = "unit handler"


class WireRecorder:
    """Records what passes between a bench and its instruments, on the clock of the session."""

    #: Whether the wire itself answers: no instrument, real or simulated, is opened.
    answers = False

    def __init__(self, log: WireLogFile, clock: Clock) -> None:
        self._log, self._clock = log, clock

    def links(self, links: LinkFactory) -> LinkFactory:
        """Return links that note what passes through them."""
        return RecordedLinks(links, self.note)

    def stream_reader(self, url: str, port: SerialPort, make: Callable[[SerialPort], StreamReader]) -> StreamReader:
        """Return what empties an open port, and notes each time it is asked."""
        raw = port.raw if isinstance(port, RecordedPort) else port
        return RecordedReader(make(raw), partial(self.note, url))

    def unit_handler(self, handler: UnitHandler) -> UnitHandler:
        """Return a unit handler that notes what is asked of it; a person's work is not noted."""
        return RecordedUnitHandler(handler, partial(self.note, UNIT_HANDLER))

    def rename(self, path: Path) -> None:
        """Give the file of the log another name. Raises OSError."""
        self._log.rename(path)

    def note(self, port: str, kind: Kind, data: bytes = b"", **more: object) -> None:
        """Add an event of a port, dated now."""
        self._log.note(Event(self._clock.now_s(), port, kind, data, more))


class RecordedLinks:
    """Links of hardware, or simulated ones; `note` adds an event of the port that is its first argument."""

    def __init__(self, links: LinkFactory, note: Note) -> None:
        self._links, self._note = links, note

    def serial_port(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> SerialPort:
        """Return an open port; raises what pyserial raises."""
        note = partial(self._note, url)
        opening = partial(self._links.serial_port, url, baudrate=baudrate, timeout_s=timeout_s, line=line)
        port: SerialPort = noted(note, "opened", opening, (Exception,))
        note("opened")
        return RecordedPort(port, note)

    def port_timeout_s(self, timeout_s: float) -> float:
        """Return the value of a port's `timeout` that stands for `timeout_s` seconds of the bench clock."""
        return self._links.port_timeout_s(timeout_s)

    def tcp_client(self, host: str, tcp_port: int, *, timeout_s: float) -> ModbusTcpClient:
        """Return a Modbus TCP client that is not connected yet."""
        client = self._links.tcp_client(host, tcp_port, timeout_s=timeout_s)
        return recorded_tcp(client, partial(self._note, address(host, tcp_port)))

    def rtu_client(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> ModbusSerialClient:
        """Return a Modbus RTU client that is not connected yet."""
        client = self._links.rtu_client(url, baudrate=baudrate, timeout_s=timeout_s, line=line)
        return recorded_rtu(client, partial(self._note, url))

    def rpc_channel(self, host: str, tcp_port: int, *, timeout_s: float) -> RpcChannel:
        """Return an open gRPC channel; raises ImportError."""
        channel = self._links.rpc_channel(host, tcp_port, timeout_s=timeout_s)
        return RecordedChannel(channel, partial(self._note, address(host, tcp_port)))


def address(host: str, tcp_port: int) -> str:
    """Return the name of a host's port in a log; a simulated one has no number."""
    return host if "://" in host else f"{host}:{tcp_port}"


class RecordedUnitHandler:
    """A unit handler whose requests are noted, as the lines in which a simulator in another process takes them."""

    def __init__(self, handler: UnitHandler, note: Note) -> None:
        self._handler, self._note = handler, note

    def mount(self, position: str) -> None:
        """Control the units: turn them so that `position` is up."""
        self._handler.mount(position)
        self._note("sent", mount_line(position).encode())

    def turn(self, position: str, turn_deg: float) -> None:
        """Control the units: have them turned by hand."""
        self._handler.turn(position, turn_deg)
        self._note("sent", turn_line(position, turn_deg).encode())

    def is_turning(self) -> bool:
        """Get whether a turn by hand is still under way."""
        turns = self._handler.is_turning()
        self._note("sent", IS_TURNING.encode())
        self._note("received", (BUSY if turns else OK).encode())
        return turns

    def power(self, on: bool) -> None:
        """Control the units: switch their power on or off."""
        self._handler.power(on)
        self._note("sent", power_line(on).encode())
