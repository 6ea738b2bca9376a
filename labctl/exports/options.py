"""Options of a format: numbers from their texts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.errors import BadInput


def number(options: Mapping[str, str], name: str, format_name: str) -> float | None:
    """Return an option as a finite number, None where it is not given; raises BadInput."""
    if name not in options:
        return None
    try:
        value = float(options[name])
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise BadInput(f"format {format_name}: option {name} = {options[name]!r} is not a number; give a number")
    return value


def whole_number(options: Mapping[str, str], name: str, limits: tuple[int, int], default: int, format_name: str) -> int:
    """Return an option as a whole number within limits; raises BadInput."""
    text = options.get(name, str(default))
    low, high = limits
    if not (text.isdecimal() and text.isascii() and low <= int(text) <= high):
        raise BadInput(f"format {format_name}: option {name} = {text!r}: give a whole number from {low} to {high}")
    return int(text)


def check_instance(name: str, instance: int, least: int, most: int) -> None:
    """Raise BadInput for a sensor that an autopilot has not: each numbers its own from `least` to `most`."""
    if not least <= instance <= most:
        raise BadInput(f"format {name}: --instance {instance}: give a number from {least} to {most}")
