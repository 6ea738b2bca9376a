"""Whole simulated benches in virtual time, with another gyro on them where a test wants one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from instruments.bench import Bench, open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock


@dataclass
class Stand:
    """A simulated bench, opened, with its faults at hand."""

    file: BenchFile
    clock: VirtualClock
    bench: Bench

    @property
    def gyro(self) -> Any:
        return next(iter(self.bench.gyros.values()))

    @property
    def world(self) -> Any:
        assert self.bench.simulation is not None
        return self.bench.simulation.world

    def faults(self, url: str) -> Any:
        assert self.bench.simulation is not None
        return self.bench.simulation.faults(url)

    @property
    def gyro_url(self) -> str:
        return self.file.gyros[0].port or self.file.gyros[0].host or ""


@pytest.fixture
def stand() -> Iterator[Callable[..., Stand]]:
    """Open a shipped bench; `gyro`, `table`, `simulation` change what its file says."""
    made: list[Stand] = []

    def make(name: str = "single-axis-sim", **changes: dict[str, Any]) -> Stand:
        record = read_bench(name).model_dump()
        for section, values in changes.items():
            target = record["gyros"][0] if section == "gyro" else record[section]
            target |= values
        file = BenchFile.model_validate(record)
        clock = VirtualClock()
        made.append(Stand(file, clock, open_bench(file, clock)))
        return made[-1]

    yield make
    for one in made:
        one.bench.close()
