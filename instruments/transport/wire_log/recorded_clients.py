"""Clients of Modbus, and channels of gRPC, whose every message is an event of a wire log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from instruments.transport.rpc.channel import RpcChannel
from instruments.transport.serial import BROKEN, SerialPort
from instruments.transport.wire_log.recorded_port import Note, RecordedPort, noted

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
