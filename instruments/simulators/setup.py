"""What a simulated instrument is built from."""

from __future__ import annotations

from dataclasses import dataclass

from instruments.bench_config import BenchFile, DeviceSettings, GyroSettings, ReferenceSettings
from instruments.errors import LinkError
from instruments.simulators.links.faults import Faults
from instruments.simulators.physics.world import SimulatedGyro, World


@dataclass(frozen=True)
class InstrumentSetup:
    """Place of one simulated instrument: its bench, the world it shares, its faults, and the gyro of its address."""

    world: World
    bench: BenchFile
    gyro_name: str
    faults: Faults
    port_buffer_bytes: int  #: unread bytes that a serial port keeps

    def instrument(self, name: str) -> DeviceSettings:
        """Return the bench file's section "table", "chamber" or "supply"; raises LinkError where the bench has none."""
        if (device := self.bench.instruments.get(name)) is None:
            raise LinkError(name, f"bench {self.bench.name} has no [{name}]; add the section, or correct the address")
        return device

    @property
    def gyro(self) -> GyroSettings:
        """Settings of the gyro at the instrument's address; raises StopIteration where the bench has none so named."""
        return next(gyro for gyro in self.bench.gyros if gyro.name == self.gyro_name)

    @property
    def reference(self) -> ReferenceSettings:
        """Settings of the reference instrument that the address names, else of the first; raises LinkError."""
        by_name = {each.name: each for each in self.bench.references}
        if not by_name:
            raise LinkError(
                "reference",
                f"bench {self.bench.name} has no reference instrument; add a [[references]] section "
                "to the bench file, or correct the port's address",
            )
        return by_name.get(self.gyro_name, next(iter(by_name.values())))

    @property
    def unit(self) -> SimulatedGyro:
        """Simulated unit at the instrument's address; raises KeyError where the bench has none so named."""
        return self.world.gyro(self.gyro_name)
