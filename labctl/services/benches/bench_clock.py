"""Which clock a campaign's times are of: the system's, or that of a simulated bench."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from instruments.bench_config import is_simulated_address


def has_simulated_time(bench: Mapping[str, Any]) -> bool:
    """Return whether a bench, as its file says it, keeps a simulated clock, which may run faster than real time."""
    if (bench.get("simulation") or {}).get("control"):  # simulators in another process set the pace
        return True
    devices = [each for each in (bench.get("table"), bench.get("chamber"), *bench.get("gyros", ())) if each]
    links = [link for device in devices for key in ("port", "host") if (link := device.get(key)) is not None]
    return bool(links) and all(is_simulated_address(link) for link in links)
