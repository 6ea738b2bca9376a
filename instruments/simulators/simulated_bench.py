"""The simulated instruments of one bench, by address, in one world."""

from __future__ import annotations

from datetime import timedelta

from instruments.bench_config import SIMULATED_SCHEME, BenchFile, is_simulated_address
from instruments.clock import Clock
from instruments.errors import LinkError
from instruments.plugins import PluginError
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.links.faults import Faults, FaultyWire
from instruments.simulators.links.serial_port import port_buffer_bytes
from instruments.simulators.physics.world import World
from instruments.simulators.registry import SIMULATORS, MakeDevice
from instruments.simulators.setup import InstrumentSetup


class SimulatedBench:
    """Every simulated instrument of a bench; the same address gives the same instrument."""

    def __init__(self, bench: BenchFile, clock: Clock) -> None:
        self.world = World(bench, clock.utc() - timedelta(seconds=clock.now_s()))
        self._port_buffer_bytes = port_buffer_bytes(clock)
        self._bench = bench
        self._faults: dict[str, Faults] = {}
        self._devices: dict[str, SimulatedDevice] = {}
        self._makers = {kind: _maker(kind) for kind in map(_kind_of, bench.links) if kind}

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at an address, behind a wire on which faults can be armed; raises LinkError."""
        if url not in self._devices:
            kind, _, gyro = url.removeprefix(SIMULATED_SCHEME).partition("/")
            make = self._makers.get(kind) or _maker(kind)
            if isinstance(make, PluginError):
                raise LinkError(url, str(make))
            faults = self.faults(url)
            name = gyro or self._bench.gyros[0].name
            instrument = make(InstrumentSetup(self.world, self._bench, name, faults, self._port_buffer_bytes))
            self._devices[url] = FaultyWire(instrument, faults)
        return self._devices[url]

    def faults(self, url: str) -> Faults:
        """Return the faults that can be armed in the instrument at an address."""
        seed = self._bench.simulation.seed if self._bench.simulation else 1
        return self._faults.setdefault(url, Faults(seed + len(self._faults)))


def _kind_of(link: str) -> str:
    """Return the kind of simulated instrument at an address; empty for one that is not simulated."""
    return link.removeprefix(SIMULATED_SCHEME).partition("/")[0] if is_simulated_address(link) else ""


def _maker(kind: str) -> MakeDevice | PluginError:
    """Return what makes a kind of simulated instrument, or why it cannot be used, which is raised when it is opened."""
    try:
        return SIMULATORS.get(kind)
    except PluginError as error:
        return error
