"""A gRPC channel whose far end is a simulated instrument, called in the calling thread.

A client library makes its calls as on a channel of grpcio: it serialises the request and parses the reply itself, and
gets a failure as `grpc.RpcError` with status, text and trailing metadata. Waits take bench clock time.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

from instruments.clock import Clock
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.links.rpc_blocks import Call, Reply, call_block, take_reply

#: Least step of the clock while a reply is awaited, s.
MIN_WAIT_S = 1e-3


class Metadatum(NamedTuple):
    """One entry of the trailing metadata."""

    key: str
    value: str


class SimulatedChannel:
    """What a client library uses of `grpc.Channel`. Every call ends within the time-out. Raises ImportError."""

    def __init__(self, device: SimulatedDevice, clock: Clock, timeout_s: float) -> None:
        self._device, self._clock, self._timeout_s = device, clock, timeout_s
        self._is_open = True
        grpc = importlib.import_module("grpc")
        self._statuses: dict[int, Any] = {status.value[0]: status for status in grpc.StatusCode}
        self._error: Any = type("SimulatedRpcError", (grpc.RpcError,), {})

    def unary_unary(
        self,
        method: str,
        request_serializer: Callable[..., bytes],
        response_deserializer: Callable[[bytes], object],
        **_settings: object,
    ) -> Callable[..., object]:
        """Return what calls a method with one request for one reply; it raises `grpc.RpcError`."""

        def call(request: object, **_options: object) -> object:
            reply = self._exchange(Call(method, request_serializer(request)))
            if reply.status or reply.message is None:
                raise self._failure(reply)
            return response_deserializer(reply.message)

        return call

    def unary_stream(self, method: str, **_settings: object) -> Callable[..., object]:
        """Return what refuses a call for a stream of replies: no simulated instrument has one."""

        def call(*_given: object, **_options: object) -> object:
            raise self._failure(Reply(None, RpcStatus.UNIMPLEMENTED, f"{method} is not simulated"))

        return call

    stream_unary = stream_stream = unary_stream

    def close(self) -> None:
        """Close the channel; safe to call twice."""
        self._is_open = False

    def _exchange(self, call: Call) -> Reply:
        """Return the reply to a call, or one that says why there is none."""
        if not self._is_open:
            return Reply(None, RpcStatus.UNAVAILABLE, "the channel is closed")
        try:
            self._device.skip(self._clock.now_s())  # replies to earlier calls belong to nothing any more
            self._device.receive(call_block(call), self._clock.now_s())
            return self._await_reply()
        except ValueError as error:
            return Reply(None, RpcStatus.INTERNAL, f"the reply cannot be read: {error}")
        except OSError as error:
            return Reply(None, RpcStatus.UNAVAILABLE, str(error))

    def _await_reply(self) -> Reply:
        deadline_s, data = self._clock.now_s() + self._timeout_s, b""
        while True:
            now_s = self._clock.now_s()
            data += self._device.transmit(now_s)
            if (reply := take_reply(data)) is not None:
                return reply
            if now_s >= deadline_s - 1e-9:
                return Reply(None, RpcStatus.DEADLINE_EXCEEDED, "Deadline Exceeded")
            next_s = self._device.next_byte_s(now_s)
            until_s = deadline_s if next_s is None else min(max(next_s, now_s + MIN_WAIT_S), deadline_s)
            self._clock.sleep(until_s - now_s)

    def _failure(self, reply: Reply) -> Exception:
        """Return a failure with the methods of a failed call."""
        status = self._statuses.get(reply.status, self._statuses[RpcStatus.INTERNAL])
        metadata = tuple(Metadatum(*pair) for pair in reply.metadata)
        error: Exception = self._error(reply.details)
        vars(error).update(
            code=lambda: status, details=lambda: reply.details, trailing_metadata=lambda: metadata,
            initial_metadata=tuple,
        )  # fmt: skip
        return error
