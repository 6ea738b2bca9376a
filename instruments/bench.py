"""Opening a bench: every driver by name, and one thing to close."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from instruments.bench_config import BenchFile
from instruments.clock import Clock, SystemClock
from instruments.drivers.arrick_c4 import ArrickC4
from instruments.drivers.gyrostar import Gyrostar
from instruments.drivers.kvh import KvhDsp3000, Rd2100
from instruments.drivers.stim300 import Stim300
from instruments.drivers.watlow_f4 import WatlowF4
from instruments.drivers.watlow_f4t import WatlowF4T
from instruments.errors import InstrumentError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable
from instruments.interfaces.unit_handler import ManualUnitHandler, RemoteUnitHandler, SimulatedUnitHandler, UnitHandler
from instruments.transport.factory import Ports, Simulation, open_simulation

TABLES: dict[str, Callable[..., RateTable]] = {"arrick-c4": ArrickC4}
CHAMBERS: dict[str, Callable[..., Chamber]] = {"watlow-f4": WatlowF4, "watlow-f4t": WatlowF4T}
GYROS: dict[str, Callable[..., Gyro]] = {
    "kvh-dsp3000": KvhDsp3000,
    "kvh-rd2100": Rd2100,
    "stim300": Stim300,
    "gyrostar": Gyrostar,
}


@dataclass(frozen=True)
class Bench:
    """The instruments of one bench, opened; nothing was sent to any of them yet."""

    table: RateTable
    chamber: Chamber
    gyros: dict[str, Gyro]
    unit_handler: UnitHandler
    simulation: Simulation | None = None

    def close(self) -> None:
        """Close every link, also when another cannot be closed; raises the first failure at the end."""
        closers: list[Callable[[], None]] = [self.table.close, self.chamber.close]
        failures: list[Exception] = []
        for close in [*(gyro.stop for gyro in self.gyros.values()), *closers]:
            try:
                close()
            except (InstrumentError, OSError) as failure:
                failures.append(failure)
        if failures:
            raise failures[0]


def open_bench(bench: BenchFile, clock: Clock, simulation: Simulation | None = None) -> Bench:
    """Make the drivers of a bench. No byte is sent before one of them is used.

    `simulation` is the world that simulated instruments stand in, where it is there already.
    """
    if simulation is None and bench.has_simulated:
        simulation = open_simulation(bench, clock)
    ports = Ports(clock, simulation)
    return Bench(
        TABLES[bench.table.driver](bench.table, ports, clock),
        CHAMBERS[bench.chamber.driver](bench.chamber, ports, clock),
        {gyro.name: GYROS[gyro.driver](gyro, ports, clock) for gyro in bench.gyros},
        _unit_handler(bench, simulation, clock),
        simulation,
    )


def check_options(bench: BenchFile) -> None:
    """Raise pydantic.ValidationError where a gyro's options are not its driver's; no byte is sent."""
    clock = SystemClock()
    for gyro in bench.gyros:
        GYROS[gyro.driver](gyro, Ports(clock), clock)


def _unit_handler(bench: BenchFile, simulation: Simulation | None, clock: Clock) -> UnitHandler:
    if simulation is not None:
        return SimulatedUnitHandler(simulation, clock)
    if bench.simulation is not None and bench.simulation.control is not None:
        return RemoteUnitHandler(bench.simulation.control)
    return ManualUnitHandler()


def check(bench: BenchFile, clock: Clock) -> list[tuple[str, bool, str]]:
    """Talk to every instrument; returns (device, whether it answered, what). Nothing moves."""
    opened = open_bench(bench, clock)
    asked: dict[str, Any] = {"table": opened.table, "chamber": opened.chamber, **opened.gyros}
    found = []
    try:
        for name, device in asked.items():
            try:
                said = device.identify()
                found.append((name, True, said if isinstance(said, str) else f"{said.model}, serial {said.serial}"))
            except InstrumentError as error:
                found.append((name, False, str(error)))
    finally:
        opened.close()
    return found
