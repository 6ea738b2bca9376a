"""A real gRPC server on this machine, without encryption, that hands each call to a simulated instrument."""

from __future__ import annotations

import importlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.simulators.links.real_ports import LOCALHOST, Exchange
from instruments.simulators.links.rpc_blocks import Call, Reply, call_block, take_reply

THREADS = 4


class RpcServer:
    """Listens on a free TCP port from the start. Raises ImportError where grpcio is not installed, and OSError."""

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._grpc = importlib.import_module("grpc")
        self._statuses = {status.value[0]: status for status in self._grpc.StatusCode}
        handler = type("Handler", (self._grpc.GenericRpcHandler,), {"service": lambda _, details: self._of(details)})
        self._threads = ThreadPoolExecutor(THREADS)
        self._server = self._grpc.server(self._threads, handlers=(handler(),))
        self.tcp_port = int(self._server.add_insecure_port(f"{LOCALHOST}:0"))
        if not self.tcp_port:
            raise OSError(f"no free TCP port at {LOCALHOST}; end a program that listens there")
        self._server.start()

    def close(self) -> None:
        """Close the port and end the threads; safe to call twice."""
        self._server.stop(None).wait()
        self._threads.shutdown()

    def _of(self, details: Any) -> Any:
        def answer(message: bytes, context: Any) -> bytes:
            reply = self._reply(Call(details.method, message))
            context.set_trailing_metadata(reply.metadata)
            if reply.status or reply.message is None:
                context.abort(self._statuses[reply.status], reply.details)
            return reply.message or b""

        return self._grpc.unary_unary_rpc_method_handler(answer)

    def _reply(self, call: Call) -> Reply:
        reply = take_reply(self._exchange(call_block(call)))
        return Reply(None, RpcStatus.UNAVAILABLE, "the simulated instrument is silent") if reply is None else reply
