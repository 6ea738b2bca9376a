"""The catalogue of effects and models, to read."""

from __future__ import annotations

from typing import Any

from labctl.fitting import describe_effects, describe_presets


def catalogue() -> dict[str, Any]:
    """Return every effect and every model preset as JSON."""
    return {"effects": describe_effects(), "models": describe_presets()}
