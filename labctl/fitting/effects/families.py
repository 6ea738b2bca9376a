"""labctl's own effects, family by family: the entry point of labctl in the group `labctl.effects`."""

from __future__ import annotations

from labctl.fitting.effects import (
    acceleration,
    alignment,
    bias,
    environment,
    history,
    nonlinearity,
    rate_table,
    scale_factor,
    surface,
    thermal,
)
from labctl.fitting.effects.base import Effect

FAMILIES = (
    bias,
    scale_factor,
    surface,
    alignment,
    nonlinearity,
    acceleration,
    rate_table,
    thermal,
    history,
    environment,
)
EFFECTS: tuple[type[Effect], ...] = tuple(kind for family in FAMILIES for kind in family.EFFECTS)
