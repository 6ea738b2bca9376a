"""Entry points of the simulators: benches in this process or on real ports, and the effects they can hide.

Simulators are imported inside the functions: a process that drives real instruments never loads them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.interfaces.unit_handler import UnitHandler
from instruments.plugins import PluginGroup
from instruments.transport.factory import LinkFactory

if TYPE_CHECKING:
    from instruments.simulators.links.device import SimulatedDevice
    from instruments.simulators.links.faults import Faults
    from instruments.simulators.physics.world import World


class Simulation(Protocol):
    """The simulated instruments of one bench, by address, and the world they share."""

    @property
    def world(self) -> World:
        """The world: table motion, heat, units."""
        ...

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at a sim:// address, always the same one; raises LinkError for an unknown address."""
        ...

    def faults(self, url: str) -> Faults:
        """Return the faults that can be armed in the instrument at a sim:// address."""
        ...


def open_simulation(bench: BenchFile, clock: Clock) -> Simulation:
    """Return the simulated instruments of a bench; raises ValueError for an unknown profile, setting or effect."""
    from instruments.simulators.simulated_bench import SimulatedBench

    return SimulatedBench(bench, clock)


def simulated_links(simulation: Simulation, clock: Clock) -> LinkFactory:
    """Return what makes the ports and clients of sim:// addresses."""
    from instruments.simulators.links.factory import SimulatedLinks

    return SimulatedLinks(simulation.device, clock)


def simulated_unit_handler(simulation: Simulation, clock: Clock) -> UnitHandler:
    """Return the unit handler that turns and switches the units of a simulated world."""
    from instruments.simulators.devices.unit_handler import SimulatedUnitHandler

    return SimulatedUnitHandler(simulation.world, clock)


def lay_simulated(simulation: Simulation, clock: Clock, up: Sequence[float]) -> None:
    """Make the person at a simulated bench turn its units until direction `up` (3,) of the body points up.

    Returns at once; a person who is at it does nothing else.
    """
    simulation.world.lay(clock.now_s(), up)


def serve_simulation(
    bench: BenchFile,
    clock: Clock,
    out: Path | None,
    ready: Callable[[dict[str, str]], None],
    log: Path | None = None,
) -> None:
    """Serve a bench's simulated instruments on real pseudo-terminals and TCP ports, until interrupted.

    `out` gets a bench file with the real addresses, `log` one JSON document per message that an instrument received;
    `ready` is called with the address of each instrument. Raises ValueError as `open_simulation` does, OSError.
    """
    from instruments.simulators.server import serve

    serve(bench, clock, out, ready, log)


def simulation_plugins() -> tuple[PluginGroup[Any], ...]:
    """Return the groups of simulated instruments and of hidden effects."""
    from instruments.simulators.hidden.catalogue import FAMILIES
    from instruments.simulators.registry import SIMULATORS

    return SIMULATORS, FAMILIES


def hidden_defaults() -> dict[str, float]:
    """Return effect id -> noticeable size, in the effect's unit, of every effect that a simulated unit can hide."""
    from instruments.simulators.hidden import EFFECTS

    return {effect_id: kind.default for effect_id, kind in EFFECTS.items()}
