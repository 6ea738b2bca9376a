"""The simulated instruments of one bench, by address, in one world."""

from __future__ import annotations

from instruments.bench_config import SIMULATED_SCHEME, BenchFile
from instruments.clock import Clock
from instruments.errors import LinkError
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.links.faults import Faults, FaultyWire
from instruments.simulators.links.serial_port import port_buffer_bytes
from instruments.simulators.physics.world import World
from instruments.simulators.registry import KINDS
from instruments.simulators.setup import InstrumentSetup


class SimulatedBench:
    """Every simulated instrument of a bench; the same address gives the same instrument."""

    def __init__(self, bench: BenchFile, clock: Clock) -> None:
        self.world = World(bench)
        self._port_buffer_bytes = port_buffer_bytes(clock)
        self._bench = bench
        self._faults: dict[str, Faults] = {}
        self._devices: dict[str, SimulatedDevice] = {}

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at an address, behind a wire on which faults can be armed; raises LinkError."""
        if url not in self._devices:
            kind, _, gyro = url.removeprefix(SIMULATED_SCHEME).partition("/")
            if kind not in KINDS:
                raise LinkError(url, f"there is no simulated instrument {kind!r} (there are {', '.join(KINDS)})")
            faults = self.faults(url)
            name = gyro or self._bench.gyros[0].name
            instrument = KINDS[kind](InstrumentSetup(self.world, self._bench, name, faults, self._port_buffer_bytes))
            self._devices[url] = FaultyWire(instrument, faults)
        return self._devices[url]

    def faults(self, url: str) -> Faults:
        """Return the faults that can be armed in the instrument at an address."""
        seed = self._bench.simulation.seed if self._bench.simulation else 1
        return self._faults.setdefault(url, Faults(seed + len(self._faults)))
