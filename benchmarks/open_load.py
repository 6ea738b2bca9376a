"""An open-loop load generator for GET requests over HTTP/1.1: `python -m benchmarks.open_load PORT RATE SECONDS UNITS`.

Requests are due at a fixed rate, whatever the answers do. The time of each is counted from when it was due, so that one
which waits for a free connection counts with its wait (no coordinated omission, as in wrk2). It runs in a process of
its own on the event loop of uvloop, with plain protocols: a client library would need more time than the service.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, cast

import numpy as np
import uvloop

from benchmarks.many_units import serial_of

CONNECTIONS = 64
#: After the last request was due, answers are waited for so long, s.
LAST_S = 10.0
#: A generator that begins a request later than this was itself too slow, ms.
LATE_MS = 5.0


class Link(asyncio.Protocol):
    """One connection with one request at a time."""

    def __init__(self, free: Callable[[Link], None]) -> None:
        self._free, self._received, self._length = free, bytearray(), -1
        self.serial, self.due_s = b"", 0.0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Keep the transport."""
        self._transport = cast(asyncio.Transport, transport)  # uvloop's has no base class

    def ask(self, serial: str, due_s: float) -> None:
        """Send a request."""
        self.serial, self.due_s, self._length = serial.encode(), due_s, -1
        self._received.clear()
        self._transport.write(b"GET /api/units/%s/calibration HTTP/1.1\r\nHost: localhost\r\n\r\n" % self.serial)

    def data_received(self, data: bytes) -> None:
        """Take a part of an answer; a wrong one ends the generator."""
        self._received += data
        if self._length < 0 and (end := self._received.find(b"\r\n\r\n")) >= 0:
            head = bytes(self._received[:end]).lower()
            assert head.startswith(b"http/1.1 200"), bytes(self._received[:300])
            self._length = end + 4 + int(head.partition(b"content-length: ")[2].partition(b"\r\n")[0])
        if 0 <= self._length <= len(self._received):
            assert self.serial in self._received
            self._free(self)


async def load(port: int, rate_per_s: float, seconds: float, units: int, seed: int = 1) -> dict[str, float]:
    """Return percentiles of the answer times, ms, and how late the generator itself was."""
    loop = asyncio.get_running_loop()
    serials = np.random.default_rng(seed).integers(units, size=round(rate_per_s * seconds))
    times, begun_late, done = [], [], asyncio.Event()
    waiting: deque[tuple[str, float]] = deque()
    free: deque[Link] = deque()
    failures: list[object] = []

    def failed(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        failures.append(context.get("exception") or context["message"])
        done.set()

    loop.set_exception_handler(failed)

    def answered(link: Link) -> None:
        times.append(loop.time() - link.due_s)
        if waiting:
            link.ask(*waiting.popleft())
        else:
            free.append(link)
        if len(times) == len(serials):
            done.set()

    for _ in range(CONNECTIONS):
        _, link = await loop.create_connection(lambda: Link(answered), "127.0.0.1", port)
        free.append(link)
    begin_s, next_, begun_s = loop.time() + 0.2, 0, time.process_time()

    def due() -> None:
        nonlocal next_
        now_s = loop.time()
        while next_ < len(serials) and (due_s := begin_s + next_ / rate_per_s) <= now_s:
            begun_late.append(now_s - due_s)
            asked = serial_of(int(serials[next_])), due_s
            next_ += 1
            if free:
                free.popleft().ask(*asked)
            else:
                waiting.append(asked)
        if next_ < len(serials):
            loop.call_at(begin_s + next_ / rate_per_s, due)

    due()
    with suppress(TimeoutError):
        await asyncio.wait_for(done.wait(), seconds + LAST_S)
    assert not failures, failures[0]
    answered_n, ended_s = len(times), loop.time()
    times += [ended_s - begin_s - n / rate_per_s for n in range(answered_n, len(serials))]  # they wait for longer still
    p50, p99, most = np.percentile(1e3 * np.array(times), [50, 99, 100])
    late = float(np.mean(1e3 * np.array(begun_late) > LATE_MS))
    return {
        "p50_ms": p50, "p99_ms": p99, "max_ms": most, "answered": float(answered_n),
        "answered_per_s": answered_n / (ended_s - begin_s), "late_share": late,
        "processor_s": time.process_time() - begun_s,
    }  # fmt: skip


if __name__ == "__main__":
    port, rate, seconds, units = (float(each) for each in sys.argv[1:5])
    print(json.dumps(uvloop.run(load(int(port), rate, seconds, int(units)))))
