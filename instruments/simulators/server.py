"""A bench's simulated instruments in a process of their own: on real pseudo-terminals and real TCP ports.

One world, one lock; a control port takes the orders of the hand that turns and switches the units.
"""

from __future__ import annotations

import json
import os
import socket
import threading
import tty
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import tomli_w

from instruments.bench_config import BenchFile, SimulationSettings
from instruments.clock import Clock, ScaledClock
from instruments.simulators.bench import SimulatedBench
from instruments.simulators.device import SimulatedDevice
from instruments.transport.factory import SIMULATED

TICK_S = 0.005  #: wall time between looks at what an instrument has to say


class Server:
    """Carries bytes between real ports and simulated instruments."""

    def __init__(self, bench: BenchFile, clock: Clock, log: TextIO | None = None) -> None:
        self._bench, self._clock, self._log = bench, clock, log
        self._simulated = SimulatedBench(bench, clock)
        self._lock = threading.Lock()
        self._over = threading.Event()
        self._threads: list[threading.Thread] = []
        self._open: list[Any] = []
        self.addresses: dict[str, str] = {}

    def start(self) -> BenchFile:
        """Open every port; returns the bench file with the real addresses in it."""
        record = self._bench.model_dump()
        places = {"table": record["table"], "chamber": record["chamber"]}
        places |= {gyro["name"]: gyro for gyro in record["gyros"]}
        for name, place in places.items():
            for key in ("port", "host"):
                url = place.get(key)
                if not url or not url.startswith(SIMULATED):
                    continue
                device = self._simulated.device(url)
                if key == "port":
                    place["port"] = self.addresses[name] = self._pty(name, device)
                else:
                    place["host"], place["tcp_port"] = (
                        "127.0.0.1",
                        self._tcp(partial(self._talk, name, device)),
                    )
                    self.addresses[name] = f"127.0.0.1:{place['tcp_port']}"
        control = self._tcp(self._obey)
        self.addresses["control"] = f"127.0.0.1:{control}"
        simulation = record["simulation"] or SimulationSettings().model_dump()
        speed = self._clock.speed if isinstance(self._clock, ScaledClock) else 1.0
        record["simulation"] = {**simulation, "control": self.addresses["control"], "speed": speed}
        return BenchFile.model_validate(record)

    def wait(self) -> None:
        """Serve until `stop` is called or the process is interrupted."""
        self._over.wait()

    def stop(self) -> None:
        """Close every port and end every thread."""
        self._over.set()
        for thread in self._threads:
            thread.join(timeout=2.0)
        for opened in self._open:
            opened.close()

    def _run(self, work: Callable[..., None], *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _pty(self, name: str, device: SimulatedDevice) -> str:
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self._open.append(os.fdopen(theirs, "rb", buffering=0))
        self._open.append(os.fdopen(os.dup(ours), "rb", buffering=0))
        self._run(self._pump, ours, name, device)
        return os.ttyname(theirs)

    def _pump(self, ours: int, name: str, device: SimulatedDevice) -> None:
        waiting = b""
        while not self._over.wait(TICK_S):
            try:
                heard = os.read(ours, 4096)
            except BlockingIOError:
                heard = b""
            with self._lock:
                now = self._clock.now_s()
                if heard:
                    self._note(name, heard, now)
                    device.receive(heard, now)
                waiting += device.transmit(now)
            try:
                waiting = waiting[os.write(ours, waiting) :] if waiting else b""
            except BlockingIOError:
                waiting = waiting[-4096:]  # nobody reads: a port keeps its last bytes
        os.close(ours)

    def _note(self, name: str, heard: bytes, t_s: float) -> None:
        """Write down what an instrument hears, and whether the table turned at that time."""
        if self._log is not None:
            turning = self._simulated.world.table.moving(t_s)
            line = {"t_s": round(t_s, 3), "device": name, "heard": heard.decode("latin-1"), "table_turns": turning}
            self._log.write(json.dumps(line) + "\n")
            self._log.flush()

    def _tcp(self, serve: Callable[[socket.socket], None]) -> int:
        listener = socket.create_server(("127.0.0.1", 0))
        listener.settimeout(0.2)
        self._open.append(listener)
        self._run(self._accept, listener, serve)
        return int(listener.getsockname()[1])

    def _accept(self, listener: socket.socket, serve: Callable[[socket.socket], None]) -> None:
        while not self._over.is_set():
            try:
                link, _ = listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            self._run(serve, link)

    def _talk(self, name: str, device: SimulatedDevice, link: socket.socket) -> None:
        link.settimeout(0.2)
        with link:
            while not self._over.is_set():
                try:
                    heard = link.recv(4096)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not heard:
                    return
                with self._lock:
                    now = self._clock.now_s()
                    self._note(name, heard, now)
                    device.receive(heard, now)
                    said = device.transmit(now)
                link.sendall(said)

    def _obey(self, link: socket.socket) -> None:
        with link, link.makefile("rw") as lines:
            for line in lines:
                word, _, rest = line.strip().partition(" ")
                with self._lock:
                    now = self._clock.now_s()
                    if word == "mount":
                        self._simulated.world.mount(now, rest)
                    elif word == "power":
                        self._simulated.world.power(now, rest == "on")
                lines.write("ok\n" if word in {"mount", "power"} else f"unknown order {word!r}\n")
                lines.flush()


def serve(
    bench: BenchFile,
    clock: Clock,
    out: Path | None,
    ready: Callable[[dict[str, str]], None],
    log: Path | None = None,
) -> None:
    """Serve a bench until interrupted; `out` gets a bench file that points here, `log` what the instruments hear."""
    with nullcontext() if log is None else log.open("w", encoding="utf-8") as lines:
        _serve(Server(bench, clock, lines), out, ready)


def _serve(server: Server, out: Path | None, ready: Callable[[dict[str, str]], None]) -> None:
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
