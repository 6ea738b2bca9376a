"""Recording a session: the links of a bench and its unit handler, with every operation in a wire log."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from instruments.clock import Clock
from instruments.interfaces.unit_handler import UnitHandler
from instruments.protocols.simulator_control import BUSY, IS_TURNING, OK, mount_line, power_line, turn_line
from instruments.transport.factory import LinkFactory
from instruments.transport.rpc import RpcChannel
from instruments.transport.serial import BROKEN, EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import Received, StreamReader
from instruments.transport.wire_log.document import Event, Kind
from instruments.transport.wire_log.log_file import WireLogFile

#: Adds an event of one port: its kind, its bytes and what else is known.
Note = Callable[..., None]
ResultT = TypeVar("ResultT")


def noted(
    note: Note, at: str, operation: Callable[[], ResultT], failures: tuple[type[Exception], ...] = BROKEN
) -> ResultT:
    """Return what an operation on a port returns; its failure becomes an event and is raised."""
    try:
        return operation()
    except failures as error:
        note("failed", at=at, text_of_error=str(error))
        raise


class RecordedPort:
    """A port of pyserial, real or simulated. `raw` is the port itself, for a reader that is recorded on its own."""

    def __init__(self, raw: SerialPort, note: Note) -> None:
        self.raw, self._note = raw, note
        self._kept = bytearray()  #: received to learn how much waits, and not yet read
        self._is_closed = False

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return bool(getattr(self.raw, "is_open", not self._is_closed))

    @property
    def timeout(self) -> float | None:
        """Longest wait of `read`, s; None: without end."""
        return self.raw.timeout

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self.raw.timeout = timeout

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        if waiting := noted(self._note, "received", lambda: self.raw.in_waiting):
            data = noted(self._note, "received", lambda: self.raw.read(waiting))
            self._note("received", data)
            self._kept += data
        return len(self._kept)

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes, or as many as arrive before the time-out."""
        if (missing := size - len(self._kept)) > 0:
            data = noted(self._note, "received", lambda: self.raw.read(missing))
            self._note("received", data, **({} if len(data) == missing else {"timed_out": True}))
            self._kept += data
        chunk = bytes(self._kept[:size])
        del self._kept[:size]
        return chunk

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""
        sent: int | None = noted(self._note, "sent", lambda: self.raw.write(data))
        self._note("sent", bytes(data))
        return sent

    def reset_input_buffer(self) -> None:
        """Drop unread bytes."""
        self._kept.clear()
        noted(self._note, "received", self.raw.reset_input_buffer)

    def flush(self) -> None:
        """Wait until everything is sent, where the port can."""
        if (flush := getattr(self.raw, "flush", None)) is not None:
            noted(self._note, "sent", flush)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self.raw.close()
        if not self._is_closed:
            self._is_closed = True
            self._note("closed")


class RecordedReader:
    """The reader of a port; each call of `take` is one event, as the times of readings follow from these calls."""

    def __init__(self, reader: StreamReader, note: Note) -> None:
        self._reader, self._note = reader, note

    def take(self) -> Received:
        """Return everything that has come since the last call."""
        received: Received = noted(self._note, "arrived", self._reader.take)
        arrived: Kind = "arrived"
        times = {"now_s": received.now_s, "newest_s": received.newest_s, "width_s": received.width_s}
        self._note(arrived, received.data, **{key: value for key, value in times.items() if value is not None})
        return received

    def discard(self) -> None:
        """Drop everything that was not taken yet."""
        noted(self._note, "arrived", self._reader.discard)

    def close(self) -> None:
        """End reading; the port stays open."""
        self._reader.close()


FAILURES: tuple[type[Exception], ...] = (ConnectionException, *BROKEN)


def recorded_tcp(client: ModbusTcpClient, note: Note) -> ModbusTcpClient:
    """Return a client whose methods that reach its socket note what they do; all else stays pymodbus's."""
    opening: Callable[[], object] = client.connect
    closing: Callable[[], object] = client.close
    sending, receiving = client.send, client.recv

    def connect() -> bool:
        was_open = client.socket is not None
        is_open = bool(opening())
        if not was_open:
            note("opened") if is_open else note("failed", at="opened", text_of_error="no connection")
        return is_open

    def close() -> None:
        was_open = client.socket is not None
        closing()
        if was_open:
            note("closed")

    def send(request: bytes, addr: tuple[str, int] | None = None) -> int:
        sent = int(noted(note, "sent", lambda: sending(request, addr), FAILURES))
        note("sent", bytes(request))
        return sent

    def recv(size: int | None) -> bytes:
        data: bytes = noted(note, "received", lambda: receiving(size), FAILURES)
        note("received", data, **({} if data else {"timed_out": True}))
        return data

    vars(client).update(connect=connect, close=close, send=send, recv=recv)
    client.transaction.low_level_send = send  # pymodbus takes it from the client when that is made
    return client


def recorded_rtu(client: ModbusSerialClient, note: Note) -> ModbusSerialClient:
    """Return a client whose port notes what it does."""
    opening = client.connect

    def connect() -> bool:
        if client.socket is not None:
            return True
        if not opening() or client.socket is None:
            note("failed", at="opened", text_of_error=str(getattr(client, "failure", None) or "no connection"))
            return False
        note("opened")
        client.socket = cast("serial.Serial", RecordedPort(cast(SerialPort, client.socket), note))
        return True

    vars(client).update(connect=connect)
    return client


class RecordedChannel:
    """A gRPC channel whose calls, as the bytes of request and reply, are noted."""

    def __init__(self, channel: RpcChannel, note: Note) -> None:
        self._channel, self._note = channel, note
        note("opened")

    def unary_unary(
        self,
        method: str,
        request_serializer: Callable[..., bytes],
        response_deserializer: Callable[[bytes], object],
        **settings: object,
    ) -> Callable[..., object]:
        """Return what calls a method with one request for one reply; it raises `grpc.RpcError`."""
        called = self._channel.unary_unary(method, _as_it_is, _as_it_is, **settings)

        def call(request: object, **options: object) -> object:
            data = request_serializer(request)
            self._note("sent", data, method=method)
            try:
                reply = cast(bytes, called(data, **options))
            except Exception as error:
                if (failure := _failure_of(error)) is not None:
                    self._note("failed", at="received", **failure)
                raise
            self._note("received", reply)
            return response_deserializer(reply)

        return call

    def unary_stream(self, method: str, **settings: object) -> Callable[..., object]:
        """Return what calls a method with one request for a stream of replies, which is not noted."""
        return self._channel.unary_stream(method, **settings)

    def close(self) -> None:
        """Close the channel; safe to call twice."""
        self._channel.close()
        self._note("closed")


def _as_it_is(message: Any) -> Any:
    return message


def _failure_of(error: Exception) -> dict[str, Any] | None:
    """Return status, text and metadata of a failed call; None for an error that is none of gRPC."""
    code, details = getattr(error, "code", None), getattr(error, "details", None)
    if code is None or details is None:
        return None
    metadata: Any = getattr(error, "trailing_metadata", tuple)() or ()
    pairs = [[str(key), value if isinstance(value, str) else bytes(value).hex()] for key, value in metadata]
    return {"text_of_error": str(details() or ""), "status": int(code().value[0]), "metadata": pairs}


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
        """Rename the file of the log. Raises OSError."""
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
        """Turn the units so that `position` is up."""
        self._handler.mount(position)
        self._note("sent", mount_line(position).encode())

    def turn(self, position: str, turn_deg: float) -> None:
        """Have the units turned by hand."""
        self._handler.turn(position, turn_deg)
        self._note("sent", turn_line(position, turn_deg).encode())

    def is_turning(self) -> bool:
        """Get whether a turn by hand is still under way."""
        turns = self._handler.is_turning()
        self._note("sent", IS_TURNING.encode())
        self._note("received", (BUSY if turns else OK).encode())
        return turns

    def power(self, on: bool) -> None:
        """Switch the power of the units on or off."""
        self._handler.power(on)
        self._note("sent", power_line(on).encode())
