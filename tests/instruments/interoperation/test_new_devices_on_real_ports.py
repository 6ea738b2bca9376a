"""Chamber, reference instrument and LabJack on real pseudo-terminals and TCP ports, through the same drivers."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock
from instruments.simulators.server import SimulationServer


def test_on_real_ports() -> None:
    record = read_bench("gyrostar-sim").model_dump()
    record["chamber"] = {"driver": "weiss-simserv", "port": "sim://weiss-simserv", "min_c": -40, "max_c": 120}
    record["references"] = [{"driver": "line-reference", "port": "sim://line-reference", "model": "omega-ithx"}]
    gyro: dict[str, Any] = {
        "driver": "labjack-t", "host": "sim://labjack-t7/gyrostar", "port": "sim://labjack-t7-stream/gyrostar",
        "sample_rate_hz": 1000, "options": {"average": 10, "thermometer_input": 1},
    }  # fmt: skip
    record["gyros"] = [record["gyros"][0] | gyro]
    clock = ScaledClock(1.0)
    server = SimulationServer(BenchFile.model_validate(record), clock)
    try:
        bench = open_bench(server.start(), clock)
        assert bench.chamber is not None
        assert bench.chamber.set_temperature_c(30.0) == 30.0
        assert bench.references["reference"].read().raw["reference_c"] == pytest.approx(25_000, abs=200)
        unit = bench.gyros["gyrostar"]
        unit.start()
        unit.read_latest()
        readings = unit.read(0.5)
        assert readings.lost == 0
        assert len(readings) == pytest.approx(50, abs=15)
        bench.close()
    finally:
        server.stop()
