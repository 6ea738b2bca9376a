"""A bench on which eight things are wrong, each of another kind, and what a check has to say of each."""

from __future__ import annotations

import fcntl
import os
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.checks.check import check
from instruments.checks.findings import DeviceReport
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from instruments.simulation import open_simulation

STIM = {
    "driver": "stim300",
    "technology": "mems",
    "max_rate_dps": 400.0,
    "sample_rate_hz": 125.0,
    "axes": ("x", "y", "z"),
}
DSP = {"driver": "kvh-dsp3000", "technology": "fog", "max_rate_dps": 375.0, "sample_rate_hz": 100.0}
F4 = "sim://watlow-f4"


@dataclass
class Terminals:
    """Real ports: one that may not be used, one that another process holds, one on another adapter, a silent one."""

    denied: str
    held: str
    moved: str
    mute: str


@contextmanager
def terminals(monkeypatch: pytest.MonkeyPatch) -> Iterator[Terminals]:
    """Give four pseudo-terminals in their states."""
    pairs = [os.openpty() for _ in range(4)]
    for _, theirs in pairs:
        tty.setraw(theirs)
    ports = Terminals(*(os.ttyname(theirs) for _, theirs in pairs))
    holder = os.open(ports.held, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(holder, fcntl.LOCK_EX | fcntl.LOCK_NB)
    access = os.access

    def may(path: Any, mode: int, **how: Any) -> bool:
        return path != ports.denied and access(path, mode, **how)

    class Adapter:
        device, serial_number, location = ports.moved, "B2", "1-1.4"

    monkeypatch.setattr("os.access", may)
    monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [Adapter])
    yield ports
    os.close(holder)
    for pair in pairs:
        for end in pair:
            os.close(end)


def spoilt_bench(ports: Terminals) -> BenchFile:
    """Return the bench."""
    record = read_bench("single-axis-sim").model_dump(exclude_none=True)
    record["name"] = "spoilt"
    record["table"]["port"] = ports.denied
    units: list[dict[str, Any]] = [
        {"name": "gone", "port": "/dev/no-such-port", **DSP},
        {"name": "held", "port": ports.held, **STIM},
        {"name": "angle", "port": "sim://stim300/angle", **STIM},
        {"name": "moved", "port": ports.moved, "adapter": "A1", **STIM},
        {"name": "mute", "port": ports.mute, **STIM},
        {"name": "fast", "port": "sim://kvh-dsp3000/fast", **DSP},
    ]
    record["gyros"] = [{"serial": f"UNIT-{unit['name'].upper()}", **unit} for unit in units]
    record["simulation"]["units"] = {
        "angle": {"device": {"output_unit": "incremental"}},
        "fast": {"sample_clock_ppm": 100_000.0},
    }
    return resolve(BenchFile.model_validate(record))


def check_spoilt(ports: Terminals) -> tuple[BenchFile, list[DeviceReport]]:
    """Return the bench and its check, while a profile runs on the chamber."""
    bench, clock = spoilt_bench(ports), VirtualClock()
    simulation = open_simulation(bench, clock)
    device: Any = simulation.device(F4)
    device._device.mode = 2  # a profile runs
    return bench, check(bench, clock, simulation)
