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
from tests.helpers.patience import WAIT_S

LOADED = """
import sys
from instruments.bench import open_bench
from instruments.bench_config import read_bench
from instruments.clock import SystemClock
import instruments.simulation
open_bench(read_bench({bench!r}), SystemClock()).close()
print(*sorted(name for name in sys.modules if name.startswith({package!r})))
"""


def loaded_by(bench: str, package: str = "instruments.simulators") -> list[str]:
    """Return the modules of a package that a fresh process has loaded after it opened a bench."""
    code = LOADED.format(bench=bench, package=package)
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True, timeout=WAIT_S
    )
    return run.stdout.split()


def test_a_real_bench_does_not_load_the_simulators() -> None:
    assert loaded_by("example-real") == []


def test_a_simulated_bench_does() -> None:
    assert "instruments.simulators.simulated_bench" in loaded_by("single-axis-sim")


LATER = """
import sys
from instruments.bench import open_bench
from instruments.bench_config import read_bench
from instruments.clock import VirtualClock
bench = open_bench(read_bench("single-axis-sim"), VirtualClock())
before = set(sys.modules)
bench.table.identify(), bench.table.home(), bench.chamber.identify(), bench.chamber.set_temperature_c(30)
spin = bench.table.spin(10, 5)
for gyro in bench.gyros.values():
    gyro.identify(), gyro.start(), gyro.read(2)
bench.table.settle(spin)
bench.close()
print(*sorted(name for name in set(sys.modules) - before if name.startswith("instruments")))
"""


def test_once_a_bench_is_open_no_driver_and_no_simulator_is_imported() -> None:
    run = subprocess.run(
        [sys.executable, "-c", LATER], cwd=ROOT, capture_output=True, text=True, check=True, timeout=WAIT_S
    )
    assert run.stdout.split() == []


def test_only_the_drivers_that_a_bench_names_are_imported() -> None:
    assert loaded_by("example-real", "instruments.drivers") == [
        "instruments.drivers",
        *(f"instruments.drivers.{name}" for name in ("arrick_c4", "arrick_c4_checks", "arrick_c4_link", "chambers")),
        *(f"instruments.drivers.chambers.{name}" for name in ("setpoint_chamber", "watlow", "watlow_f4")),
        *(
            f"instruments.drivers.{name}"
            for name in (
                "driver",
                "kvh",
                "probe",
                "probes",
                "registry",
                "resolution",
                "streamed_readings",
                "unit_handlers",
            )
        ),
    ]


def test_a_real_bench_has_no_simulation_and_needs_a_person() -> None:
    bench = open_bench(read_bench("example-real"), VirtualClock())
    assert bench.simulation is None
    assert isinstance(bench.unit_handler, ManualUnitHandler)


def test_a_simulated_address_that_no_simulator_knows_is_named() -> None:
    record = read_bench("single-axis-sim").model_dump()
    record["table"]["port"] = "sim://turntable"
    bench = open_bench(BenchFile.model_validate(record), VirtualClock())
    with pytest.raises(
        LinkError, match=r"no simulated instrument 'turntable' is installed \(installed: acutrol-3000 \(labctl "
    ):
        bench.table.identify()
