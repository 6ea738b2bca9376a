"""The simulated instruments of one bench, by address, in one world."""

from __future__ import annotations

from collections.abc import Callable

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.errors import LinkError
from instruments.simulators.adam6017 import Adam6017
from instruments.simulators.arrick_c4 import SimulatedC4
from instruments.simulators.device import SimulatedDevice
from instruments.simulators.kvh import SimulatedDsp3000, SimulatedRd2100
from instruments.simulators.links.faults import Faults, FaultyWire
from instruments.simulators.links.serial_port import room_bytes
from instruments.simulators.physics.world import World
from instruments.simulators.stim300 import SimulatedStim300
from instruments.simulators.watlow_f4 import SimulatedF4
from instruments.simulators.watlow_f4t import SimulatedF4T

Factory = Callable[[World, BenchFile, str, Faults], SimulatedDevice]

#: What stands behind sim://KIND or sim://KIND/GYRO.
KINDS: dict[str, Factory] = {
    "arrick": SimulatedC4,
    "watlow-f4": SimulatedF4,
    "watlow-f4t": SimulatedF4T,
    "stim300": SimulatedStim300,
    "kvh-dsp3000": SimulatedDsp3000,
    "kvh-rd2100": SimulatedRd2100,
    "adam-6017": Adam6017,
}


class SimulatedBench:
    """Every simulated instrument of a bench; the same address gives the same instrument."""

    def __init__(self, bench: BenchFile, clock: Clock) -> None:
        self.world = World(bench)
        self.world.room_bytes = room_bytes(clock)
        self.clock = clock
        self._bench = bench
        self._faults: dict[str, Faults] = {}
        self._devices: dict[str, SimulatedDevice] = {}

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at an address, behind a wire on which faults can be armed."""
        if url not in self._devices:
            kind, _, gyro = url.removeprefix("sim://").partition("/")
            if kind not in KINDS:
                raise LinkError(url, f"there is no simulated instrument {kind!r} (there are {', '.join(KINDS)})")
            faults = self.faults(url)
            made = KINDS[kind](self.world, self._bench, gyro or self._bench.gyros[0].name, faults)
            self._devices[url] = FaultyWire(made, faults)
        return self._devices[url]

    def faults(self, url: str) -> Faults:
        """Return what can be armed in the instrument at an address."""
        seed = self._bench.simulation.seed if self._bench.simulation else 1
        return self._faults.setdefault(url, Faults(seed + len(self._faults)))
