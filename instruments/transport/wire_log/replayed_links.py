"""Ports, readers, clients and channels that answer from a wire log."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, cast

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from instruments.interfaces.unit_handler import UnitHandler
from instruments.protocols.simulator_control import BUSY, IS_TURNING, mount_line, power_line, turn_line
from instruments.transport.factory import LinkFactory
from instruments.transport.rpc import RpcChannel
from instruments.transport.serial import EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import Received, StreamReader
from instruments.transport.wire_log.document import Event
from instruments.transport.wire_log.recorder import UNIT_HANDLER, address
from instruments.transport.wire_log.replay import LATE_S, Replay, failure_of, is_received


class ReplayedWire:
    """The wire of a bench whose instruments are those of a recorded session."""

    #: Whether the wire itself answers: no instrument, real or simulated, is opened.
    answers = True

    def __init__(self, replay: Replay) -> None:
        self._replay = replay

    def links(self, links: LinkFactory) -> LinkFactory:
        """Return links to the recorded instruments; those given are not used."""
        del links
        return ReplayedLinks(self._replay)

    def stream_reader(self, url: str, port: SerialPort, make: Callable[[SerialPort], StreamReader]) -> StreamReader:
        """Return what empties an open port as it was emptied in the session."""
        del port, make
        return ReplayedReader(self._replay, url)

    def unit_handler(self, handler: UnitHandler) -> UnitHandler:
        """Return the recorded unit handler."""
        del handler
        return ReplayedUnitHandler(self._replay)


class ReplayedLinks:
    """Links to the instruments of a recorded session. Every wait takes virtual time."""

    def __init__(self, replay: Replay) -> None:
        self._replay = replay

    def serial_port(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> SerialPort:
        """Return an open port, whatever its settings; raises OSError where the session could not open it."""
        del baudrate, line
        self._replay.opened(url)
        return ReplayedPort(self._replay, url, timeout_s)

    def port_timeout_s(self, timeout_s: float) -> float:
        """Return the time-out as it is: a replayed port waits on the bench clock."""
        return timeout_s

    def tcp_client(self, host: str, tcp_port: int, *, timeout_s: float) -> ModbusTcpClient:
        """Return a Modbus TCP client that is not connected yet."""
        return ReplayedTcpClient(self._replay, address(host, tcp_port), timeout_s)

    def rtu_client(self, url: str, *, baudrate: int, timeout_s: float, line: Line = EIGHT_N_1) -> ModbusSerialClient:
        """Return a Modbus RTU client that is not connected yet."""
        del line
        return ReplayedRtuClient(self._replay, url, timeout_s, baudrate)

    def rpc_channel(self, host: str, tcp_port: int, *, timeout_s: float) -> RpcChannel:
        """Return an open gRPC channel; raises ImportError."""
        del timeout_s
        return ReplayedChannel(self._replay, address(host, tcp_port))


class ReplayedPort:
    """A port whose far end is a wire log."""

    def __init__(self, replay: Replay, port: str, timeout_s: float | None) -> None:
        self._replay, self._port = replay, port
        self.timeout = timeout_s
        self.is_open = True
        self._unread = bytearray()

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        self._replay.refuse_over(self._port)
        while (event := self._next()) is not None and event.t_s <= self._replay.clock.now_s():
            self._take(event)
        return len(self._unread)

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes, or those that had come when the session stopped waiting for more."""
        self._replay.refuse_over(self._port)
        clock = self._replay.clock
        begun_s = clock.now_s()
        while len(self._unread) < size:
            event = self._next()
            if event is None or (self.timeout is not None and event.t_s > begun_s + self.timeout + LATE_S):
                clock.reach(begun_s + (self.timeout or 0.0))
                break
            if self._take(event).more.get("timed_out") and len(self._unread) < size:
                break
        data = bytes(self._unread[:size])
        del self._unread[:size]
        return data

    def write(self, data: bytes, /) -> int:
        """Send bytes; raises ReplayOver where the session sent others."""
        self._replay.sent(self._port, bytes(data))
        return len(data)

    def reset_input_buffer(self) -> None:
        """Drop unread bytes."""
        self._unread.clear()

    def flush(self) -> None:
        """Do nothing: no byte waits to be sent."""

    def close(self) -> None:
        """Close the port; safe to call twice."""
        if self.is_open:
            self.is_open = False
            self._replay.closed(self._port)

    def _next(self) -> Event | None:
        """Return the next event if it is one of receiving; None while the instrument waits for a request."""
        event = self._replay.record.next(self._port)
        return event if event is not None and is_received(event) else None

    def _take(self, event: Event) -> Event:
        self._replay.take(self._port)
        if event.kind == "failed":
            raise failure_of(event)
        self._unread += event.data
        return event


class ReplayedReader:
    """Empties a port as often, and with the same bytes, as in the session."""

    def __init__(self, replay: Replay, port: str) -> None:
        self._replay, self._port = replay, port

    def take(self) -> Received:
        """Return what the next reading of the session returned, and what came since where that is past."""
        replay, data, event = self._replay, b"", None
        replay.refuse_over(self._port)
        while (next_event := replay.record.next(self._port)) is not None and _arrives(next_event):
            if event is not None and next_event.t_s > replay.clock.now_s():
                break
            event = replay.take(self._port)
            if event.kind == "failed":
                raise failure_of(event)
            data += event.data
        if event is None:
            return Received(b"", replay.clock.now_s())
        now_s, newest_s, width_s = map(event.number, ("now_s", "newest_s", "width_s"))
        return Received(data, event.t_s if now_s is None else now_s, newest_s, width_s)

    def discard(self) -> None:
        """Do nothing: what was dropped is not in the log."""
        self._replay.refuse_over(self._port)

    def close(self) -> None:
        """Do nothing: nothing runs."""


def _arrives(event: Event) -> bool:
    return event.kind == "arrived" or event.more.get("at") == "arrived"


class ReplayedTcpClient(ModbusTcpClient):
    """A Modbus TCP client whose far end is a wire log; framing and numbers of requests are pymodbus's."""

    def __init__(self, replay: Replay, port: str, timeout_s: float) -> None:
        super().__init__("replayed", timeout=replay.clock.wall_s(timeout_s), retries=0)
        self._replay, self._port, self._timeout_s = replay, port, timeout_s

    def connect(self) -> bool:
        """Open the link; False where the session could not."""
        if self.socket is None:
            try:
                self._replay.opened(self._port)
            except OSError:
                return False
            self.socket = cast(Any, ReplayedPort(self._replay, self._port, self._timeout_s))
        return True

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a request."""
        del addr
        return self._on_link(lambda port: port.write(request))

    def recv(self, size: int | None) -> bytes:
        """Return what came next in the session, at most `size` bytes; nothing where it waited in vain."""
        return self._on_link(lambda port: port.read(size) if size else port.read(1) + port.read(port.in_waiting))

    def _on_link(self, use: Callable[[ReplayedPort], Any]) -> Any:
        if self.socket is None:
            raise ConnectionException(str(self))
        try:
            return use(cast(ReplayedPort, self.socket))
        except OSError as error:
            cast(Any, self).close()
            raise ConnectionException(f"{self}: {error}") from error


class ReplayedRtuClient(ModbusSerialClient):
    """A Modbus RTU client whose port is a wire log."""

    def __init__(self, replay: Replay, port: str, timeout_s: float, baudrate: int) -> None:
        wall_s = replay.clock.wall_s(timeout_s)
        super().__init__("replayed", framer=FramerType.RTU, baudrate=baudrate, timeout=wall_s, retries=0)
        self._replay, self._port, self._timeout_s = replay, port, timeout_s
        self.failure: Exception | None = None  #: why the port could not be opened

    def connect(self) -> bool:
        """Open the port; False where the session could not."""
        if self.socket is None:
            try:
                self._replay.opened(self._port)
            except OSError as error:
                self.failure = error
                return False
            self.socket = cast("serial.Serial", ReplayedPort(self._replay, self._port, self._timeout_s))
        return True

    def recv(self, size: int | None) -> bytes:  # noqa: ARG002  pymodbus asks again for what is still to come
        """Read what had come: the first bytes and all that came with them."""
        if self.socket is None:
            raise ConnectionException(str(self))
        try:
            first: bytes = self.socket.read(1)
            return first + self.socket.read(self.socket.in_waiting) if first else b""
        except OSError as error:
            cast(Any, self).close()
            raise ConnectionException(f"{self}: {error}") from error


class ReplayedChannel:
    """A gRPC channel whose far end is a wire log. Raises ImportError without grpcio."""

    def __init__(self, replay: Replay, port: str) -> None:
        self._replay, self._port = replay, port
        self._grpc: Any = importlib.import_module("grpc")
        replay.opened(port)

    def unary_unary(
        self,
        method: str,
        request_serializer: Callable[..., bytes],
        response_deserializer: Callable[[bytes], object],
        **_settings: object,
    ) -> Callable[..., object]:
        """Return what calls a method with one request for one reply; it raises `grpc.RpcError`."""

        def call(request: object, **_options: object) -> object:
            self._replay.sent(self._port, request_serializer(request), method)
            event = self._replay.record.next(self._port)
            if event is None or not is_received(event):
                raise self._failure({"text_of_error": "the log has no reply to this call", "status": 14})
            self._replay.take(self._port)
            if event.kind == "failed":
                raise self._failure(event.more)
            return response_deserializer(event.data)

        return call

    def unary_stream(self, method: str, **_settings: object) -> Callable[..., object]:
        """Return what refuses a call for a stream of replies: a wire log has none."""

        def call(*_given: object, **_options: object) -> object:
            raise self._failure({"text_of_error": f"{method} is not in a wire log", "status": 12})

        return call

    stream_unary = stream_stream = unary_stream

    def close(self) -> None:
        """Close the channel; safe to call twice."""
        self._replay.closed(self._port)

    def _failure(self, failure: Any) -> Exception:
        """Return a failure with the methods of a failed call."""
        status = next(each for each in self._grpc.StatusCode if each.value[0] == failure["status"])
        metadata = tuple((key, value) for key, value in failure.get("metadata", ()))
        error: Exception = type("ReplayedRpcError", (self._grpc.RpcError,), {})(failure["text_of_error"])
        error.__dict__.update(
            code=lambda: status, details=lambda: failure["text_of_error"], trailing_metadata=lambda: metadata,
            initial_metadata=tuple,
        )  # fmt: skip
        return error


class ReplayedUnitHandler:
    """Turns and switches the units when the session did; where a person did it, at once."""

    def __init__(self, replay: Replay) -> None:
        self._replay = replay

    def mount(self, position: str) -> None:
        """Replay what was recorded."""
        self._request(mount_line(position))

    def turn(self, position: str, turn_deg: float) -> None:
        """Replay what was recorded."""
        self._request(turn_line(position, turn_deg))

    def is_turning(self) -> bool:
        """Get what the session was answered."""
        self._request(IS_TURNING)
        event = self._replay.record.next(UNIT_HANDLER)
        return event is not None and event.kind == "received" and self._replay.take(UNIT_HANDLER).data == BUSY.encode()

    def power(self, on: bool) -> None:
        """Replay what was recorded."""
        self._request(power_line(on))

    def _request(self, line: str) -> None:
        if self._replay.record.next(UNIT_HANDLER) is not None:
            self._replay.sent(UNIT_HANDLER, line.encode())
