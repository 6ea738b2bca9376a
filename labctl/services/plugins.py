"""Plug-ins: what is installed, by whom, what of it cannot be used, and whether a driver does what every driver must."""

from __future__ import annotations

from collections.abc import Callable

from instruments.bench_config import BenchFile
from instruments.conformance import Outcome, try_driver
from instruments.drivers.registry import DRIVERS
from instruments.plugins import PluginError
from instruments.simulation import simulation_plugins
from labctl.answers.admin import DriverCheckResponse, DriverTestResponse, PluginResponse
from labctl.errors import BadInput
from labctl.exports import FORMATS
from labctl.fitting.effects.families import FAMILIES
from labctl.services.planning.loading import load_bench
from labctl.services.recordings.importers import IMPORTERS
from procedures.experiments import GROUP as EXPERIMENTS


def list_plugins() -> list[PluginResponse]:
    """Return every plug-in of every group, labctl's own parts too; all of them are imported."""
    groups = (DRIVERS, *simulation_plugins(), FAMILIES, FORMATS, IMPORTERS, EXPERIMENTS)
    return [
        PluginResponse(
            group=plugin.group, name=plugin.name, distribution=plugin.distribution, version=plugin.version,
            target=plugin.target, problem=problem,
        )
        for group in groups
        for plugin, problem in group.status()
    ]  # fmt: skip


def check_driver(
    name: str, bench: str | None = None, done: Callable[[DriverCheckResponse], None] | None = None
) -> DriverTestResponse:
    """Try a driver on its simulator, in virtual time; `done` is called after each check.

    `bench` is a simulated bench file that has the driver; none: the driver's own trial, or a shipped bench. Raises
    BadInput for a driver that is not installed, cannot be loaded, or has no simulator; BadBench.
    """
    file: BenchFile | None = None if bench is None else load_bench(bench)
    checks = []
    try:
        plugin = DRIVERS.plugin(name)
        for outcome in try_driver(name, file):
            checks.append(_response(outcome))
            if done is not None:
                done(checks[-1])
    except (PluginError, ValueError) as error:
        raise BadInput(str(error)) from error
    return DriverTestResponse(
        driver=name, distribution=plugin.distribution, version=plugin.version,
        ok=not any(check.problem for check in checks), checks=checks,
    )  # fmt: skip


def _response(outcome: Outcome) -> DriverCheckResponse:
    return DriverCheckResponse(check=outcome.check, problem=outcome.problem)
