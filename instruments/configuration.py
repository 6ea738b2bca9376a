"""The configuration that a unit reports, compared with the stated one: filter, compensation, range, firmware ..."""

from __future__ import annotations

from collections.abc import Mapping

#: Reported values that do not affect the readings.
IDENTITY = frozenset({"serial", "adapter"})


def configuration_of(reported: Mapping[str, str]) -> dict[str, str]:
    """Return the configuration of a unit from its reported values; empty where it reports none."""
    return {name: value for name, value in reported.items() if name not in IDENTITY}


def not_as_stated(stated_settings: Mapping[str, str], reported: Mapping[str, str]) -> list[str]:
    """Return the differences between stated and reported configuration, one phrase each; a missing value is one."""
    configuration = configuration_of(reported)
    return [
        f"{name} is {configuration[name]} instead of {value}"
        if name in configuration
        else f"it does not report {name} ({value})"
        for name, value in stated_settings.items()
        if configuration.get(name) != value
    ]


def changed(before: Mapping[str, str], now: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Return name -> (previous, present) setting, of those that were reported both times and differ."""
    then, configuration_now = configuration_of(before), configuration_of(now)
    return {
        name: (then[name], configuration_now[name])
        for name in then
        if name in configuration_now and configuration_now[name] != then[name]
    }
