"""Benches: which there are, whether their instruments answer, and simulated ones on real ports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from instruments.bench import check
from instruments.bench_config import shipped_benches
from instruments.clock import ScaledClock, SystemClock, VirtualClock
from instruments.simulation import serve_simulation
from labctl.errors import BadInput
from labctl.services.planning.loading import load_bench
from labctl.services.schemas.benches import BenchCheckResponse, DeviceCheck, ShippedBench


def check_bench(source: str) -> BenchCheckResponse:
    """Talk to every instrument of a bench and say what answered; nothing moves."""
    bench = load_bench(source)
    clock = VirtualClock() if bench.is_simulated else SystemClock()
    devices = [
        DeviceCheck(device=device, ok=ok, text=text, **bench.drivers[device].model_dump())
        for device, ok, text in check(bench, clock)
    ]
    return BenchCheckResponse(bench=source, ok=all(each.ok for each in devices), devices=devices)


def shipped() -> list[ShippedBench]:
    """Return the benches that come with labctl: name, and what stands on them."""
    found = []
    for name, path in shipped_benches().items():
        bench = load_bench(str(path))
        units = ", ".join(f"{gyro.serial} ({gyro.driver})" for gyro in bench.gyros)
        found.append(
            ShippedBench(name=name, text=", ".join([*(each.driver for each in bench.instruments.values()), units]))
        )
    return found


def serve_simulator(
    source: str, out: Path | None, speed: float, ready: Callable[[dict[str, str]], None], log: Path | None = None
) -> None:
    """Put a bench's simulated instruments on real pseudo-terminals and TCP ports, until interrupted.

    `log` gets one JSON document per line: when which instrument heard what, and whether the table turned.
    """
    if not 0 < speed < float("inf"):
        raise BadInput(f"--speed {speed}: give a positive number; 1 is real time")
    serve_simulation(load_bench(source), ScaledClock(speed), out, ready, log)
