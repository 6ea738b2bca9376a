"""A gRPC channel of grpcio, whose calls all end in bounded time. grpcio is an optional package: it is imported here."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import partial
from typing import Any, Protocol

#: Longest reply, bytes: gRPC's own limit of 4 MiB is less than a full buffer of fast inputs.
LONGEST_REPLY_BYTES = 64 * 2**20
OPTIONS = (
    ("grpc.enable_http_proxy", 0),  # an instrument is not behind the proxy of the web
    ("grpc.max_receive_message_length", LONGEST_REPLY_BYTES),
)


class RpcChannel(Protocol):
    """The part of `grpc.Channel` that the clients of instruments use, real or simulated."""

    def unary_unary(
        self,
        method: str,
        request_serializer: Callable[..., bytes],
        response_deserializer: Callable[[bytes], object],
        **settings: object,
    ) -> Callable[..., object]:
        """Return what calls a method with one request for one reply; it raises `grpc.RpcError`."""
        ...

    def unary_stream(self, method: str, **settings: object) -> Callable[..., object]:
        """Return what calls a method with one request for a stream of replies."""
        ...

    def close(self) -> None:
        """Close the channel; safe to call twice."""
        ...


class TimedChannel:
    """A channel to a server without encryption; connects with the first call. Raises ImportError without grpcio.

    A call without a reply ends after `timeout_s` of real time as `grpc.RpcError` with the status DEADLINE_EXCEEDED.
    """

    def __init__(self, host: str, tcp_port: int, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._channel: Any = importlib.import_module("grpc").insecure_channel(target(host, tcp_port), options=OPTIONS)

    def unary_unary(
        self,
        method: str,
        request_serializer: Callable[..., bytes],
        response_deserializer: Callable[[bytes], object],
        **settings: object,
    ) -> Callable[..., object]:
        """Return what calls a method with one request for one reply; it raises `grpc.RpcError`."""
        made = self._channel.unary_unary(method, request_serializer, response_deserializer, **settings)
        return partial(made, timeout=self._timeout_s)

    def unary_stream(self, method: str, **settings: object) -> Callable[..., object]:
        """Return what calls a method with one request for a stream of replies."""
        return partial(self._channel.unary_stream(method, **settings), timeout=self._timeout_s)

    def close(self) -> None:
        """Close the channel; safe to call twice."""
        self._channel.close()


def target(host: str, tcp_port: int) -> str:
    """Return an address as gRPC takes it: one of IPv6 stands in brackets."""
    return f"[{host}]:{tcp_port}" if ":" in host and not host.startswith("[") else f"{host}:{tcp_port}"
