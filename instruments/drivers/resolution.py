"""From the names in a bench file to installed drivers: each section checked by its driver's own model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from instruments.bench_config import BenchFile, DeviceSettings, DriverRelease
from instruments.drivers.driver import ChamberDriver, GyroDriver, ReferenceDriver, SupplyDriver, TableDriver
from instruments.drivers.registry import DRIVERS, KINDS, Driver, names_of
from instruments.plugins import PluginError, UnknownPlugin

Place = tuple[str | int, ...]


def resolve(bench: BenchFile) -> BenchFile:
    """Return a bench whose sections are of their drivers' own models, with the release of each driver.

    Raises pydantic.ValidationError with the place of each driver that is not installed, cannot be loaded or is of
    another kind, and of each setting that its driver does not take. A plug-in is imported when a section names it.
    """
    wrong: list[InitErrorDetails] = []
    kinds: dict[str, type[Driver]] = {"table": TableDriver, "chamber": ChamberDriver, "supply": SupplyDriver}
    fixed = {name: _section(section, (name,), kinds[name], wrong) for name, section in bench.instruments.items()}
    gyros = [_section(gyro, ("gyros", number), GyroDriver, wrong) for number, gyro in enumerate(bench.gyros)]
    references = [
        _section(reference, ("references", number), ReferenceDriver, wrong)
        for number, reference in enumerate(bench.references)
    ]
    if wrong:
        raise ValidationError.from_exception_data(type(bench).__name__, wrong)
    used = {
        **fixed,
        **{each.name: each for each in bench.gyros},
        **{reference.name: reference for reference in bench.references},
    }
    drivers = {device: _release(section.driver) for device, section in used.items()}
    return bench.model_copy(
        update={**fixed, "gyros": tuple(gyros), "references": tuple(references), "drivers": drivers}
    )


def driver_of(section: DeviceSettings) -> Any:
    """Return the driver of a resolved section: of the kind of its place."""
    return DRIVERS.get(section.driver)


def _release(name: str) -> DriverRelease:
    plugin = DRIVERS.plugin(name)
    return DriverRelease(driver=name, distribution=plugin.distribution, version=plugin.version)


def _section(
    section: DeviceSettings, place: Place, kind: type[Driver], wrong: list[InitErrorDetails]
) -> DeviceSettings:
    """Return a section by its driver's model; what is wrong with it is added to `wrong`."""
    try:
        driver = _driver(section.driver, kind)
    except PluginError as error:
        wrong.append(_detail("driver", str(error), (*place, "driver"), section.driver))
        return section
    if type(section) is driver.settings:
        return section
    try:
        settings: DeviceSettings = driver.settings.model_validate(section.model_dump(exclude_unset=True))
    except ValidationError as error:
        wrong += [_detail(each["type"], each["msg"], (*place, *each["loc"]), each["input"]) for each in error.errors()]
        return section
    for name, value in (settings.model_extra or {}).items():
        text = f"driver {section.driver} has no such setting; choose one of {_settings_of(driver)}"
        wrong.append(_detail("extra_forbidden", text, (*place, name), value))
    return settings


def _driver(name: str, kind: type[Driver]) -> Driver:
    """Return an installed driver of one kind; raises PluginError saying what is installed and what to do."""
    kind_name, _ = KINDS[kind]
    try:
        driver = DRIVERS.get(name)
    except UnknownPlugin as error:
        raise UnknownPlugin(DRIVERS.unknown(name, names_of(kind))) from error
    if not isinstance(driver, kind):
        drives, _ = KINDS[type(driver)]
        driver_names: Sequence[str] = names_of(kind)
        choice = f"choose {', '.join(driver_names)}" if driver_names else f"no driver of a {kind_name} is installed"
        raise PluginError(f"driver {name!r} is for a {drives}, not for a {kind_name}; {choice}")
    return driver


def _settings_of(driver: Driver) -> str:
    return ", ".join(driver.settings.model_fields)


def _detail(kind: str, text: str, place: Place, detail: Any) -> InitErrorDetails:
    # pydantic asks for a literal, and repeats here a kind that it has given itself
    error = PydanticCustomError(kind, "{text}", {"text": text})  # pyright: ignore[reportArgumentType]
    return {"type": error, "loc": place, "input": detail}
