"""Whether the bench of a campaign had a simulated clock, or simulated instruments, by its bench file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from instruments.bench_config import is_simulated_address
from labctl.answers.json_object import JsonObject


def has_simulated_time(bench: JsonObject) -> bool:
    """Return whether a bench has a simulated clock by its file; such a clock may run faster than real time."""
    simulation = bench.get("simulation")
    if isinstance(simulation, Mapping) and simulation.get("control"):  # simulators in another process set the pace
        return True
    links = list(_links(bench, ("table", "chamber", "gyros")))
    return bool(links) and all(map(is_simulated_address, links))


def has_simulated_instrument(bench: JsonObject) -> bool:
    """Return whether any instrument of a bench is simulated."""
    return any(map(is_simulated_address, _links(bench, tuple(bench))))


def _links(bench: JsonObject, sections: tuple[str, ...]) -> Iterator[str]:
    """Yield the ports and hosts of the devices in sections of a bench."""
    for name in sections:
        section = bench.get(name)
        for device in section if isinstance(section, list | tuple) else (section,):
            if isinstance(device, Mapping):
                yield from (str(device[key]) for key in ("port", "host") if device.get(key) is not None)
