"""A driver as an entry point of the group `labctl.drivers` gives it: the model of its settings, and how it is made.

A model adds the driver's own keys to those that every instrument of its kind has. `make` gets the settings, the ports
of the bench and its clock, and returns the driver; no byte is sent before the driver is used. `trial` says where the
driver is tried.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from instruments.bench_config import ChamberSettings, GyroSettings, ReferenceSettings, SupplySettings, TableSettings
from instruments.clock import Clock
from instruments.drivers.probe import HostProbe, Probe
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.reference import Reference
from instruments.interfaces.supply import Supply
from instruments.interfaces.table import RateTable
from instruments.transport.factory import Ports

TableT = TypeVar("TableT", bound=TableSettings)
ChamberT = TypeVar("ChamberT", bound=ChamberSettings)
GyroT = TypeVar("GyroT", bound=GyroSettings)
ReferenceT = TypeVar("ReferenceT", bound=ReferenceSettings)
SupplyT = TypeVar("SupplyT", bound=SupplySettings)


@dataclass(frozen=True)
class Trial:
    """Where `labctl driver test` tries a driver: on a simulated bench that ships with labctl, in place of its own part.

    `section` is what the bench file says of the driver's table, chamber, supply, reference or first gyro: the address
    of the driver's simulator, and what else it needs; `unit` is the table of the gyro in [simulation.units], `table`
    what [simulation.table] has beside what the bench says.
    """

    bench: str = "single-axis-sim"
    section: Mapping[str, object] = field(default_factory=dict)
    unit: Mapping[str, object] = field(default_factory=dict)
    table: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class TableDriver(Generic[TableT]):
    """Driver of a rate table."""

    settings: type[TableT]
    make: Callable[[TableT, Ports, Clock], RateTable]
    trial: Trial | None = None  #: not needed where a shipped simulated bench has the driver
    probe: Probe | HostProbe | None = None  #: recognises it, for `labctl bench new`


@dataclass(frozen=True)
class ChamberDriver(Generic[ChamberT]):
    """Driver of a thermal chamber."""

    settings: type[ChamberT]
    make: Callable[[ChamberT, Ports, Clock], Chamber]
    trial: Trial | None = None  #: not needed where a shipped simulated bench has the driver
    probe: Probe | HostProbe | None = None  #: recognises it, for `labctl bench new`


@dataclass(frozen=True)
class GyroDriver(Generic[GyroT]):
    """Driver of a gyro."""

    settings: type[GyroT]
    make: Callable[[GyroT, Ports, Clock], Gyro]
    trial: Trial | None = None  #: not needed where a shipped simulated bench has the driver
    probe: Probe | HostProbe | None = None  #: recognises it, for `labctl bench new`


@dataclass(frozen=True)
class ReferenceDriver(Generic[ReferenceT]):
    """Driver of a reference thermometer or hygrometer."""

    settings: type[ReferenceT]
    make: Callable[[ReferenceT, Ports, Clock], Reference]
    trial: Trial | None = None  #: not needed where a shipped simulated bench has the driver
    probe: Probe | HostProbe | None = None  #: recognises it, for `labctl bench new`


@dataclass(frozen=True)
class SupplyDriver(Generic[SupplyT]):
    """Driver of a programmable power supply of the units."""

    settings: type[SupplyT]
    make: Callable[[SupplyT, Ports, Clock], Supply]
    trial: Trial | None = None  #: not needed where a shipped simulated bench has the driver
    probe: Probe | HostProbe | None = None  #: recognises it, for `labctl bench new`
