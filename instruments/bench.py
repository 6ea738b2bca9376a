"""Composition root: opens the instruments of a bench file by driver name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails

from instruments.bench_config import BenchFile
from instruments.clock import Clock, SystemClock
from instruments.drivers.registry import CHAMBERS, GYROS, TABLES
from instruments.drivers.unit_handlers import ManualUnitHandler, RemoteUnitHandler
from instruments.errors import InstrumentError
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable
from instruments.interfaces.unit_handler import UnitHandler
from instruments.simulation import Simulation, open_simulation, simulated_links, simulated_unit_handler
from instruments.transport.factory import Ports


@dataclass(frozen=True)
class Bench:
    """The instruments of one bench, opened; no byte was sent to any of them yet."""

    table: RateTable
    chamber: Chamber
    gyros: dict[str, Gyro]
    unit_handler: UnitHandler
    simulation: Simulation | None = None  #: the simulated instruments of this process, where the bench has any

    def close(self) -> None:
        """Close every link, also after one cannot be closed; raises the first InstrumentError or OSError at the end."""
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
    """Return the drivers of a bench; no byte is sent before one of them is used.

    `simulation` is the world of the simulated instruments where it exists already. Raises pydantic.ValidationError for
    an unknown driver and for options that are not of a gyro's driver, LimitError for an option that the driver cannot
    use, and ValueError for an unknown profile, setting or hidden effect of the simulation.
    """
    check_drivers(bench)
    if simulation is None and bench.has_simulated:
        simulation = open_simulation(bench, clock)
    ports = Ports(clock, None if simulation is None else simulated_links(simulation, clock))
    return Bench(
        TABLES[bench.table.driver](bench.table, ports, clock),
        CHAMBERS[bench.chamber.driver](bench.chamber, ports, clock),
        {gyro.name: GYROS[gyro.driver](gyro, ports, clock) for gyro in bench.gyros},
        _unit_handler(bench, simulation, clock),
        simulation,
    )


def check_drivers(bench: BenchFile) -> None:
    """Raise pydantic.ValidationError with each unknown driver, its place in the bench file and the known names."""
    given: list[tuple[tuple[str | int, ...], str, Iterable[str]]] = [
        (("table", "driver"), bench.table.driver, TABLES),
        (("chamber", "driver"), bench.chamber.driver, CHAMBERS),
        *((("gyros", number, "driver"), gyro.driver, GYROS) for number, gyro in enumerate(bench.gyros)),
    ]
    unknown: list[InitErrorDetails] = [
        {"type": "literal_error", "loc": place, "input": name, "ctx": {"expected": _alternatives(known)}}
        for place, name, known in given
        if name not in known
    ]
    if unknown:
        raise ValidationError.from_exception_data(type(bench).__name__, unknown)


def check_settings(bench: BenchFile) -> None:
    """Raise pydantic.ValidationError for an unknown driver, or options that are not of a gyro's; no byte is sent."""
    check_drivers(bench)
    clock = SystemClock()
    for gyro in bench.gyros:
        GYROS[gyro.driver](gyro, Ports(clock), clock)


def check(bench: BenchFile, clock: Clock) -> list[tuple[str, bool, str]]:
    """Ask every instrument for its identity; nothing moves. Returns (device, whether it answered, text)."""
    opened = open_bench(bench, clock)
    devices: dict[str, Any] = {"table": opened.table, "chamber": opened.chamber, **opened.gyros}
    results = []
    try:
        for name, device in devices.items():
            try:
                found = device.identify()
                text = found if isinstance(found, str) else f"{found.model}, serial {found.serial}"
                results.append((name, True, text))
            except InstrumentError as error:
                results.append((name, False, str(error)))
    finally:
        opened.close()
    return results


def _unit_handler(bench: BenchFile, simulation: Simulation | None, clock: Clock) -> UnitHandler:
    if simulation is not None:
        return simulated_unit_handler(simulation, clock)
    if bench.simulation is not None and bench.simulation.control is not None:
        return RemoteUnitHandler(bench.simulation.control)
    return ManualUnitHandler()


def _alternatives(names: Iterable[str]) -> str:
    """Return names as pydantic lists the values of a literal: 'a', 'b' or 'c'."""
    *most, last = map(repr, names)
    return f"{', '.join(most)} or {last}" if most else last
