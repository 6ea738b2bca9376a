"""How a unit is set, as it says itself, beside what it should be: filter, compensation, range, firmware and so on."""

from __future__ import annotations

from collections.abc import Mapping

#: What a unit says of itself that does not change its readings.
IDENTITY = frozenset({"serial", "adapter"})


def configuration_of(reported: Mapping[str, str]) -> dict[str, str]:
    """Return how a unit is set, by what it says of itself; empty where it says nothing."""
    return {name: value for name, value in reported.items() if name not in IDENTITY}


def not_as_stated(stated_settings: Mapping[str, str], reported: Mapping[str, str]) -> list[str]:
    """Return where a unit is not set as it is stated to be, one phrase each; what it does not say counts."""
    configuration = configuration_of(reported)
    return [
        f"{name} is {configuration[name]} instead of {value}"
        if name in configuration
        else f"it does not report {name} ({value})"
        for name, value in stated_settings.items()
        if configuration.get(name) != value
    ]


def changed(before: Mapping[str, str], now: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Return name -> setting before and now, of those that were reported both times and differ."""
    then, configuration_now = configuration_of(before), configuration_of(now)
    return {
        name: (then[name], configuration_now[name])
        for name in then
        if name in configuration_now and configuration_now[name] != then[name]
    }
