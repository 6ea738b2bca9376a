"""A driver as an entry point of the group `labctl.drivers` gives it: the model of its settings, and how it is made.

A model adds the driver's own keys to those that every instrument of its kind has. `make` gets the settings, the ports
of the bench and its clock, and returns the driver; no byte is sent before the driver is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from instruments.bench_config import ChamberSettings, GyroSettings, TableSettings
from instruments.clock import Clock
from instruments.interfaces.chamber import Chamber
from instruments.interfaces.gyro import Gyro
from instruments.interfaces.table import RateTable
from instruments.transport.factory import Ports

TableT = TypeVar("TableT", bound=TableSettings)
ChamberT = TypeVar("ChamberT", bound=ChamberSettings)
GyroT = TypeVar("GyroT", bound=GyroSettings)


@dataclass(frozen=True)
class TableDriver(Generic[TableT]):
    """Driver of a rate table."""

    settings: type[TableT]
    make: Callable[[TableT, Ports, Clock], RateTable]


@dataclass(frozen=True)
class ChamberDriver(Generic[ChamberT]):
    """Driver of a thermal chamber."""

    settings: type[ChamberT]
    make: Callable[[ChamberT, Ports, Clock], Chamber]


@dataclass(frozen=True)
class GyroDriver(Generic[GyroT]):
    """Driver of a gyro."""

    settings: type[GyroT]
    make: Callable[[GyroT, Ports, Clock], Gyro]
