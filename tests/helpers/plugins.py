"""Plug-ins for one test: an object under a name in a group, as if a distribution of that name were installed."""

from __future__ import annotations

from typing import Any

import pytest

from instruments.plugins import Plugin, PluginGroup


def register(
    monkeypatch: pytest.MonkeyPatch, group: PluginGroup[Any], name: str, found: Any, distribution: str = "acme-plugins"
) -> Plugin:
    """Enter a loaded object into a group for the rest of a test; returns its entry point."""
    plugin = Plugin(group.group, name, f"acme:{name}", distribution, "0.3")
    names = {**group._by_name}
    names[name] = [*names.get(name, []), plugin]
    monkeypatch.setitem(group.__dict__, "_by_name", names)
    monkeypatch.setattr(group, "_loaded", {**group._loaded, name: found})
    return plugin
