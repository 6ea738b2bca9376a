"""Effects that can be hidden in a simulated unit; `catalogue.py` lists them by id."""

from __future__ import annotations

from instruments.simulators.hidden.base import HiddenEffect, State
from instruments.simulators.hidden.catalogue import EFFECTS, hidden_effects

__all__ = ["EFFECTS", "HiddenEffect", "State", "hidden_effects"]
