"""Plug-ins: what is installed, by whom, and what of it cannot be used."""

from __future__ import annotations

from instruments.drivers.registry import DRIVERS
from instruments.simulation import simulation_plugins
from labctl.exports import FORMATS
from labctl.fitting.effects.catalogue import FAMILIES
from labctl.services.recordings.importers import IMPORTERS
from labctl.services.schemas.admin import PluginResponse


def list_plugins() -> list[PluginResponse]:
    """Return every plug-in of every group, labctl's own parts too; all of them are imported."""
    groups = (DRIVERS, *simulation_plugins(), FAMILIES, FORMATS, IMPORTERS)
    return [
        PluginResponse(
            group=plugin.group, name=plugin.name, distribution=plugin.distribution, version=plugin.version,
            target=plugin.target, problem=problem,
        )
        for group in groups
        for plugin, problem in group.status()
    ]  # fmt: skip
