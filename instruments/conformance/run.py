"""Runs the checks of a driver, each on a fresh bench."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from instruments.bench_config import BenchFile
from instruments.conformance.by_kind import OF_KIND
from instruments.conformance.checks import COMMON, Failed
from instruments.conformance.stand import Stand, kind_of, open_stand, place_of
from instruments.errors import InstrumentError
from instruments.plugins import summary

Check = Callable[[Stand], None]


class Outcome(NamedTuple):
    """Outcome of one check: what the driver must do, and what it does instead (empty: the check passed)."""

    check: str
    problem: str


def checks_of(name: str) -> tuple[Check, ...]:
    """Return the checks of a driver; raises PluginError for one that is not installed."""
    return (*COMMON, *OF_KIND[kind_of(name)])


def try_driver(name: str, file: BenchFile | None = None) -> Iterator[Outcome]:
    """Yield the outcome of each check of a driver, on the given bench or on that of `place_of`.

    Raises PluginError for a driver that is not installed or cannot be loaded, ValueError where no simulated bench has
    it.
    """
    file = place_of(name) if file is None else file
    for check in checks_of(name):
        yield Outcome(check.__name__.replace("_", " "), _problem(check, name, file))


def _problem(check: Check, name: str, file: BenchFile) -> str:
    stand = open_stand(name, file)
    try:
        check(stand)
        stand.bench.close()
    except Failed as failure:
        return str(failure)
    except InstrumentError as error:
        return f"raised {type(error).__name__} in a normal situation: {error}"
    except Exception as error:  # noqa: BLE001  a driver of another package may raise anything
        return f"raised {summary(error)}; every failure of a driver must be an InstrumentError"
    return ""
