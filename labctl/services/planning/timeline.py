"""The steps of a plan as columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from labctl.services.schemas.plans import (
    TimelineColumns,
)


def timeline_columns(steps: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Return the steps of a plan (JSON) as columns; set point and position stay in force until the next."""
    found: dict[str, list[Any]] = {name: [] for name in TimelineColumns.model_fields}
    start_s, temperature_c, position = 0.0, None, None
    for number, step in enumerate(steps, start=1):
        temperature_c, position = step.get("temperature_c", temperature_c), step.get("position", position)
        row = {
            "number": number, "kind": step["kind"], "start_s": start_s, "expected_s": step["expected_s"],
            "temperature_c": temperature_c, "rate_dps": step.get("rate_dps"), "position": position,
            "dataset": step.get("dataset"),
        }  # fmt: skip
        for name, value in row.items():
            found[name].append(value)
        start_s += step["expected_s"]
    return found
