"""Families of effects that installed distributions bring: the entry points of the group `labctl.effects`."""

from __future__ import annotations

from typing import Any

from instruments.plugins import PluginGroup
from labctl.fitting.effects.base import Effect
from labctl.fitting.effects.formula import NAME
from labctl.fitting.effects.trial import refuse_useless

Kinds = tuple[Effect, ...]


def _checked(declared: Any) -> Kinds:
    """Return a class of effect, or several, as effects; raises TypeError or ValueError where one cannot be fitted."""
    kinds = (declared,) if isinstance(declared, type) else tuple(declared)
    effects = []
    for kind in kinds:
        if not (isinstance(kind, type) and issubclass(kind, Effect)):
            raise TypeError(f"{kind!r} is not a subclass of labctl.fitting.effects.Effect; derive it from that class")
        effect = kind()
        if not NAME.fullmatch(effect.id):
            raise ValueError(
                f"effect id {effect.id!r} is not valid; use small letters, digits and _ only, beginning with a letter"
            )
        refuse_useless(effect)
        effects.append(effect)
    return tuple(effects)


FAMILIES: PluginGroup[Kinds] = PluginGroup("labctl.effects", "family of effects", _checked)
