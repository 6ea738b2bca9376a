"""Simulated benches with a programmable supply of the units."""

from __future__ import annotations

from typing import Any

from instruments.bench_config import BenchFile

SUPPLY_URL = "sim://rigol-dp800"
SUPPLY: dict[str, Any] = {
    "driver": "rigol-dp800", "host": SUPPLY_URL, "nominal_v": 5.0, "min_v": 4.5, "max_v": 5.5, "current_limit_a": 1.0
}  # fmt: skip


def with_supply(bench: BenchFile, hidden: dict[str, float] | None = None, **settings: Any) -> BenchFile:
    """Return a bench with a supply, and with effects hidden in its units."""
    record = bench.model_dump(exclude={"drivers", "reported"})
    record["supply"] = SUPPLY | settings
    record["simulation"]["hidden"] |= hidden or {}
    return BenchFile.model_validate(record)
