"""A bench of real instruments is opened without the simulators."""

from __future__ import annotations

import subprocess
import sys

import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.unit_handlers import ManualUnitHandler
from instruments.errors import LinkError
from tests.helpers.paths import ROOT

LOADED = """
import sys
from instruments.bench import open_bench
from instruments.bench_config import read_bench
from instruments.clock import SystemClock
import instruments.simulation
open_bench(read_bench({bench!r}), SystemClock()).close()
print(*sorted(name for name in sys.modules if name.startswith("instruments.simulators")))
"""


def loaded_by(bench: str) -> list[str]:
    """Return the simulator modules that a fresh process has loaded after it opened a bench."""
    code = LOADED.format(bench=bench)
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60)
    return run.stdout.split()


def test_a_real_bench_does_not_load_the_simulators() -> None:
    assert loaded_by("example-real") == []


def test_a_simulated_bench_does() -> None:
    assert "instruments.simulators.simulated_bench" in loaded_by("single-axis-sim")


def test_a_real_bench_has_no_simulation_and_needs_a_person() -> None:
    bench = open_bench(read_bench("example-real"), VirtualClock())
    assert bench.simulation is None
    assert isinstance(bench.unit_handler, ManualUnitHandler)


def test_a_simulated_address_that_no_simulator_knows_is_named() -> None:
    record = read_bench("single-axis-sim").model_dump()
    record["table"]["port"] = "sim://turntable"
    bench = open_bench(BenchFile.model_validate(record), VirtualClock())
    with pytest.raises(
        LinkError, match=r"no simulated instrument 'turntable' is installed \(there are adam-6017 \(labctl "
    ):
        bench.table.identify()
