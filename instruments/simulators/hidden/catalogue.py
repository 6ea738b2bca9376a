"""Effects that can be hidden in a simulated unit, each under its catalogue id and with a shape of its own."""

from __future__ import annotations

from instruments.simulators.hidden.base import HiddenEffect
from instruments.simulators.hidden.environment import EFFECTS as ENVIRONMENT
from instruments.simulators.hidden.rate import EFFECTS as RATE
from instruments.simulators.hidden.temperature_and_time import EFFECTS as SLOW

EFFECTS: dict[str, type[HiddenEffect]] = {kind.id: kind for kind in (*RATE, *SLOW, *ENVIRONMENT)}


def hidden_effects(sizes: dict[str, float | str], seed: list[int]) -> list[HiddenEffect]:
    """Return effects by id and size; raises ValueError for an unknown id, with the known ones."""
    made = []
    for effect_id, size in sizes.items():
        if effect_id not in EFFECTS:
            raise ValueError(f"effect {effect_id!r} cannot be hidden (there are {', '.join(sorted(EFFECTS))})")
        made.append(EFFECTS[effect_id](float(size), seed))
    return made
