"""A bench's simulated instruments in a process of their own, on real pseudo-terminals and real TCP ports.

One world, one lock. A control port takes the requests of the unit handler in the other process.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import tomli_w

from instruments.bench_config import BenchFile, is_simulated_address
from instruments.clock import Clock, ScaledClock
from instruments.errors import LinkError
from instruments.protocols.nidaqmx.service import INSTALL_GRPC
from instruments.protocols.simulator_control import BUSY, IS_TURNING, MOUNT, OK, POWER, TURN, turn_of
from instruments.shared_clock import SharedClock
from instruments.simulators.links.device import SimulatedDevice, connected
from instruments.simulators.links.real_ports import LOCALHOST, RealPorts
from instruments.simulators.links.rpc_server import RpcServer
from instruments.simulators.simulated_bench import SimulatedBench


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
        devices = {name: record[name] for name in ("table", "chamber", "supply") if name in record}
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
