"""Which clock a campaign's times are of: the system's, or that of a simulated bench."""

from __future__ import annotations

from collections.abc import Mapping

from instruments.bench_config import is_simulated_address
from labctl.json_types import JsonObject


def has_simulated_time(bench: JsonObject) -> bool:
    """Return whether a bench, as its file says it, keeps a simulated clock, which may run faster than real time."""
    simulation, gyros = bench.get("simulation"), bench.get("gyros")
    if isinstance(simulation, Mapping) and simulation.get("control"):  # simulators in another process set the pace
        return True
    devices = [bench.get("table"), bench.get("chamber"), *(gyros if isinstance(gyros, list | tuple) else ())]
    links = [
        link
        for device in devices
        for key in ("port", "host")
        if isinstance(device, Mapping) and (link := device.get(key)) is not None
    ]
    return bool(links) and all(is_simulated_address(str(link)) for link in links)
