"""A bench's simulated instruments in a process of their own, on real pseudo-terminals and real TCP ports.

One world, one lock. A control port takes the requests of the unit handler in the other process.
"""

from __future__ import annotations

import importlib
import json
import os
import socket
import threading
import tty
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import tomli_w

from instruments.bench_config import BenchFile, is_simulated_address
from instruments.clock import Clock, ScaledClock, SystemClock, attending, look_every_s
from instruments.errors import LinkError
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.nidaqmx.service import INSTALL_GRPC
from instruments.protocols.simulator_control import BUSY, IS_TURNING, MOUNT, OK, POWER, TURN, turn_of
from instruments.shared_clock import SharedClock
from instruments.simulators.links.device import SimulatedDevice, connected
from instruments.simulators.links.rpc_blocks import Call, Reply, call_block, take_reply
from instruments.simulators.simulated_bench import SimulatedBench

#: Bytes from the host -> bytes of the instrument; called with b"" when the host sent nothing.
Exchange = Callable[[bytes], bytes]

LOCALHOST = "127.0.0.1"
ACCEPT_TIMEOUT_S = 0.2
JOIN_TIMEOUT_S = 2.0
BLOCK_BYTES = 4096  #: of one read; a terminal that is not read keeps this many last bytes


class RealPorts:
    """Open ports and their threads, for which `clock` waits where it is one that waits."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or SystemClock()
        self._every_s = look_every_s(self._clock)
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []
        self._open: list[Any] = []

    def open_terminal(self, exchange: Exchange) -> str:
        """Open a pseudo-terminal; returns the path that a host opens. Raises OSError."""
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self._open.append(os.fdopen(theirs, "rb", buffering=0))
        self._open.append(os.fdopen(os.dup(ours), "rb", buffering=0))
        self._run(self._carry_terminal, ours, exchange)
        return os.ttyname(theirs)

    def open_byte_server(self, exchange_of_link: Callable[[], Exchange]) -> int:
        """Listen for connections that carry the instrument's bytes; returns the TCP port. Raises OSError.

        `exchange_of_link` is called once for each connection.
        """

        def carry(connection: socket.socket) -> None:
            self._carry_connection(connection, exchange_of_link())

        return self._listen(carry)

    def open_line_server(self, answer: Callable[[str], str]) -> int:
        """Listen for connections with one request per line; returns the TCP port. Raises OSError."""

        def carry(connection: socket.socket) -> None:
            with connection, connection.makefile("rw") as lines:
                for line in lines:
                    lines.write(f"{answer(line)}\n")
                    lines.flush()

        return self._listen(carry)

    def wait(self) -> None:
        """Return when `close` is called."""
        self._closing.wait()

    def close(self) -> None:
        """Close every port and end every thread; safe to call twice."""
        self._closing.set()
        for thread in self._threads:
            thread.join(timeout=JOIN_TIMEOUT_S)
        for opened in self._open:
            opened.close()

    def _run(self, work: Callable[..., None], *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _listen(self, carry: Callable[[socket.socket], None]) -> int:
        listener = socket.create_server((LOCALHOST, 0))
        listener.settimeout(ACCEPT_TIMEOUT_S)
        self._open.append(listener)
        self._run(self._accept, listener, carry)
        return int(listener.getsockname()[1])

    def _accept(self, listener: socket.socket, carry: Callable[[socket.socket], None]) -> None:
        while not self._closing.is_set():
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            self._run(carry, connection)

    def _carry_terminal(self, ours: int, exchange: Exchange) -> None:
        waiting = b""
        with attending(self._clock) as look:
            while not self._closing.wait(self._every_s):
                try:
                    received = os.read(ours, BLOCK_BYTES)
                except BlockingIOError:
                    received = b""
                waiting += exchange(received)
                try:
                    waiting = waiting[os.write(ours, waiting) :] if waiting else b""
                except BlockingIOError:
                    waiting = waiting[-BLOCK_BYTES:]  # the terminal is full: a port keeps its last bytes
                look()
        os.close(ours)

    def _carry_connection(self, connection: socket.socket, exchange: Exchange) -> None:
        connection.settimeout(self._every_s)
        with connection, attending(self._clock) as look:
            while not self._closing.is_set():
                look()
                try:
                    received = connection.recv(BLOCK_BYTES)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not received:
                    return
                connection.sendall(exchange(received))


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


class SimulationServer:
    """Serves the simulated instruments of a bench; `log` gets one JSON document per message to an instrument."""

    def __init__(self, bench: BenchFile, clock: Clock, log: TextIO | None = None) -> None:
        self._bench, self._clock, self._log = bench, clock, log
        self._simulated = SimulatedBench(bench, clock)
        self._lock = threading.Lock()
        self._ports = RealPorts(clock)
        self._rpc_servers: list[RpcServer] = []
        self.addresses: dict[str, str] = {}  #: device name, or "control" -> real address

    def start(self) -> BenchFile:
        """Open every port; returns the bench file with the real addresses. Raises OSError, LinkError."""
        record = self._bench.model_dump(exclude_none=True)  # a bench file has no null, nor have a driver's own settings
        devices = {name: record[name] for name in ("table", "chamber") if name in record}
        devices |= {each["name"]: each for each in (*record["gyros"], *record["references"])}
        for name, settings in devices.items():
            self._serve_device(name, settings)
        self.addresses["control"] = f"{LOCALHOST}:{self._ports.open_line_server(self._control)}"
        simulation = record.get("simulation", {})
        speed = self._clock.speed if isinstance(self._clock, ScaledClock) else 1.0
        record["simulation"] = {**simulation, "control": self.addresses["control"], "speed": speed}
        if isinstance(self._clock, SharedClock):
            record["simulation"]["clock"] = str(self._clock.path)
        return BenchFile.model_validate(record)

    def wait(self) -> None:
        """Serve until `stop` is called or the process is interrupted."""
        self._ports.wait()

    def stop(self) -> None:
        """Close every port and end every thread."""
        self._ports.close()
        for server in self._rpc_servers:
            server.close()

    def _serve_device(self, name: str, settings: dict[str, Any]) -> None:
        """Open a real port for a device with a simulated address, and write that port into its settings."""
        if (url := settings.get("port")) and is_simulated_address(url):
            exchange = partial(self._exchange, name, self._simulated.device(url))
            settings["port"] = self.addresses[name] = self._ports.open_terminal(exchange)
        if (url := settings.get("host")) and is_simulated_address(url):
            settings["host"], settings["tcp_port"] = LOCALHOST, self._listen(name, self._simulated.device(url))
            self.addresses[name] = f"{LOCALHOST}:{settings['tcp_port']}"

    def _listen(self, name: str, device: SimulatedDevice) -> int:
        """Open a TCP port that carries bytes, or calls of gRPC, to a device; returns its number."""
        if not getattr(device, "is_rpc", False):
            return self._ports.open_byte_server(lambda: partial(self._exchange, name, connected(device)))
        try:
            self._rpc_servers.append(RpcServer(partial(self._exchange, name, device)))
        except ImportError as error:
            raise LinkError(name, f"the package grpcio is not installed; run `{INSTALL_GRPC}`") from error
        return self._rpc_servers[-1].tcp_port

    def _exchange(self, name: str, device: SimulatedDevice, data: bytes) -> bytes:
        """Pass bytes to an instrument; returns the bytes that it has sent."""
        with self._lock:
            now_s = self._clock.now_s()
            if data:
                self._log_message(name, data, now_s)
                device.receive(data, now_s)
            return device.transmit(now_s)

    def _log_message(self, name: str, data: bytes, t_s: float) -> None:
        if self._log is not None:
            turning = self._simulated.world.table_turns(t_s)
            line = {"t_s": round(t_s, 3), "device": name, "heard": data.decode("latin-1"), "table_turns": turning}
            self._log.write(json.dumps(line) + "\n")
            self._log.flush()

    def _control(self, line: str) -> str:
        """Execute a control line of the unit handler; returns the reply line."""
        command, _, argument = line.strip().partition(" ")
        with self._lock:
            now_s = self._clock.now_s()
            if command == MOUNT:
                self._simulated.world.mount(now_s, argument)
            elif command == POWER:
                self._simulated.world.power(now_s, argument == "on")
            elif command == TURN:
                self._simulated.world.turn_by_hand(now_s, *turn_of(argument))
            elif command == IS_TURNING:
                return BUSY if self._simulated.world.hand.is_turning(now_s) else OK
            else:
                return f"unknown order {command!r}"
        return OK


def serve(
    bench: BenchFile,
    clock: Clock,
    out: Path | None,
    ready: Callable[[dict[str, str]], None],
    log: Path | None = None,
) -> None:
    """Serve a bench until interrupted; `out` gets a bench file with the real addresses, `log` the received messages."""
    with nullcontext() if log is None else log.open("w", encoding="utf-8") as lines:
        _serve(SimulationServer(bench, clock, lines), out, ready)


def _serve(server: SimulationServer, out: Path | None, ready: Callable[[dict[str, str]], None]) -> None:
    try:
        real = server.start()
        if out is not None:
            out.write_text(tomli_w.dumps(real.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
        ready(server.addresses)
        server.wait()
    except KeyboardInterrupt:
        pass
    finally:
        server.stop()
