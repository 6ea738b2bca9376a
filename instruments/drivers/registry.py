"""Every installed driver by the name that a bench file gives it: the entry points of the group `labctl.drivers`."""

from __future__ import annotations

from typing import Any

from instruments.bench_config import (
    ChamberSettings,
    DeviceSettings,
    GyroSettings,
    ReferenceSettings,
    SupplySettings,
    TableSettings,
)
from instruments.drivers.driver import ChamberDriver, GyroDriver, ReferenceDriver, SupplyDriver, TableDriver
from instruments.plugins import PluginGroup

Driver = TableDriver[Any] | ChamberDriver[Any] | GyroDriver[Any] | ReferenceDriver[Any] | SupplyDriver[Any]
#: Kind of driver -> what it drives, and the model that its settings extend.
KINDS: dict[type[Driver], tuple[str, type[DeviceSettings]]] = {
    TableDriver: ("table", TableSettings),
    ChamberDriver: ("chamber", ChamberSettings),
    GyroDriver: ("gyro", GyroSettings),
    ReferenceDriver: ("reference", ReferenceSettings),
    SupplyDriver: ("supply", SupplySettings),
}


def _checked(driver: Any) -> Driver:
    if not isinstance(driver, TableDriver | ChamberDriver | GyroDriver | ReferenceDriver | SupplyDriver):
        raise TypeError(
            f"{driver!r} is not a TableDriver, ChamberDriver, GyroDriver, ReferenceDriver or SupplyDriver of "
            "instruments.drivers.driver; make it one of these"
        )
    _, base = KINDS[type(driver)]
    if not (isinstance(driver.settings, type) and issubclass(driver.settings, base)):
        raise TypeError(
            f"its settings class {driver.settings!r} is not a subclass of "
            f"instruments.bench_config.{base.__name__}; derive it from that class"
        )
    return driver


DRIVERS: PluginGroup[Driver] = PluginGroup("labctl.drivers", "driver", _checked)


def names_of(kind: type[Driver]) -> list[str]:
    """Return the names of the drivers of one kind; all are imported."""
    return [name for name, driver in DRIVERS.all().items() if isinstance(driver, kind)]
