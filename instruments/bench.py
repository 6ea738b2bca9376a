"""Composition root: opens the instruments of a bench file by driver name.

Drivers and simulators are imported here; once a bench is open, none is imported any more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from instruments.bench_config import BenchFile
from instruments.clock import Clock, SystemClock
from instruments.drivers.resolution import driver_of, resolve
from instruments.drivers.unit_handlers import ManualUnitHandler, RemoteUnitHandler
from instruments.errors import InstrumentError, WrongSimulation
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from instruments.interfaces.unit_handler import UnitHandler
from instruments.simulation import Simulation, open_simulation, simulated_links, simulated_unit_handler
from instruments.transport.factory import Ports, Wire


@dataclass(frozen=True)
class Bench:
    """The instruments of one bench, opened; no byte was sent to any of them yet."""

    table: RateTable | None
    chamber: Chamber | None
    gyros: dict[str, Gyro]
    unit_handler: UnitHandler
    simulation: Simulation | None = None  #: the simulated instruments of this process, where the bench has any
    references: dict[str, Reference] = field(default_factory=dict)  #: by name
    configurations: dict[str, dict[str, str]] = field(default_factory=dict)  #: unit -> how it is to be set
    supply: Supply | None = None  #: of the units

    def close(self) -> None:
        """Close every link, also after one cannot be closed; raises the first InstrumentError or OSError at the end."""
        closers: list[Callable[[], None]] = [each.close for each in (self.table, self.chamber, self.supply) if each]
        closers += [reference.close for reference in self.references.values()]
        failures: list[Exception] = []
        for close in [*(gyro.stop for gyro in self.gyros.values()), *closers]:
            try:
                close()
            except (InstrumentError, OSError) as failure:
                failures.append(failure)
        if failures:
            raise failures[0]


def open_bench(bench: BenchFile, clock: Clock, simulation: Simulation | None = None, wire: Wire | None = None) -> Bench:
    """Return the drivers of a bench; no byte is sent before one of them is used.

    `simulation` is the world of the simulated instruments where it exists already. `wire` records what passes between
    drivers and instruments, or answers in place of the instruments. Raises pydantic.ValidationError for
    a driver that cannot be used and for settings that it does not take, LimitError for a setting that the driver cannot
    use, and WrongSimulation for an unknown profile, setting or hidden effect of the simulation.
    """
    bench = resolve(bench)
    if simulation is None and bench.has_simulated and not (wire is not None and wire.answers):
        try:
            simulation = open_simulation(bench, clock)
        except ValueError as error:
            raise WrongSimulation("simulation", str(error)) from error
    ports = Ports(clock, None if simulation is None else simulated_links(simulation, clock), bench.adapters, wire)
    return Bench(
        None if bench.table is None else driver_of(bench.table).make(bench.table, ports, clock),
        None if bench.chamber is None else driver_of(bench.chamber).make(bench.chamber, ports, clock),
        {gyro.name: driver_of(gyro).make(gyro, ports, clock) for gyro in bench.gyros},
        _unit_handler(bench, simulation, clock, wire),
        simulation,
        {reference.name: driver_of(reference).make(reference, ports, clock) for reference in bench.references},
        {gyro.name: gyro.configuration for gyro in bench.gyros},
        None if bench.supply is None else driver_of(bench.supply).make(bench.supply, ports, clock),
    )


def checked_settings(bench: BenchFile) -> BenchFile:
    """Return a bench with its sections by their drivers' models; no byte is sent.

    Raises pydantic.ValidationError as `resolve` does, LimitError for an option that a gyro's driver cannot use.
    """
    resolved = resolve(bench)
    clock = SystemClock()
    for gyro in resolved.gyros:
        driver_of(gyro).make(gyro, Ports(clock), clock)
    return resolved


def _unit_handler(bench: BenchFile, simulation: Simulation | None, clock: Clock, wire: Wire | None) -> UnitHandler:
    if simulation is not None:
        handler = simulated_unit_handler(simulation, clock)
    elif bench.simulation is not None and bench.simulation.control is not None:
        handler = RemoteUnitHandler(bench.simulation.control)
    else:
        handler = ManualUnitHandler()
        if wire is None or not wire.answers:  # what a person does passes no wire
            return handler
    return handler if wire is None else wire.unit_handler(handler)
