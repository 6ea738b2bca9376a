"""A simulated bench in virtual time with a tap on its Modbus wires: what was sent, byte by byte. A pytest plugin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.chambers.watlow_f4 import WatlowF4
from instruments.drivers.chambers.watlow_f4t import WatlowF4T
from instruments.drivers.gyrostar import Gyrostar
from instruments.drivers.resolution import resolve
from instruments.simulators.links.factory import SimulatedLinks
from instruments.simulators.links.faults import Faults
from instruments.simulators.simulated_bench import SimulatedBench
from instruments.transport.factory import Ports
from tests.helpers.tap import Tap


class WatchedPorts(Ports):
    """Ports that know whom they opened."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.opened: list[ModbusTcpClient | ModbusSerialClient] = []

    def modbus_tcp(self, *arguments: Any, **settings: Any) -> ModbusTcpClient:
        client = super().modbus_tcp(*arguments, **settings)
        self.opened.append(client)
        return client

    def modbus_rtu(self, *arguments: Any, **settings: Any) -> ModbusSerialClient:
        client = super().modbus_rtu(*arguments, **settings)
        self.opened.append(client)
        return client


class Rig:
    """One instrument of a shipped bench: driver, ports, its simulated self, its faults and its wire."""

    def __init__(
        self, bench: str, url: str, chamber: dict[str, Any], options: dict[str, Any], simulated: dict[str, Any]
    ) -> None:
        record = read_bench(bench).model_dump()
        record["chamber"] |= chamber
        record["simulation"]["chamber"] |= simulated
        record["gyros"][0]["options"] = {**record["gyros"][0].get("options", {}), **options}
        self.bench = resolve(BenchFile.model_validate(record))
        self.clock = VirtualClock()
        simulation = SimulatedBench(self.bench, self.clock)
        self.ports = WatchedPorts(self.clock, SimulatedLinks(simulation.device, self.clock))
        self.world = simulation.world
        self.faults: Faults = simulation.faults(url)
        wire: Any = simulation.device(url)
        self.simulated: Any = wire._device  # what stands behind the faulty wire
        self.tap = Tap(wire)
        simulation._devices[url] = self.tap
        self.driver = self.make_driver()

    def make_driver(self) -> Any:
        """Make a driver that knows nothing yet."""
        return None

    def close(self) -> None:
        for client in self.ports.opened:
            client.close()


class F4Rig(Rig):
    def make_driver(self) -> WatlowF4:
        return WatlowF4(self.bench.chamber, self.ports, self.clock)


class F4TRig(Rig):
    def make_driver(self) -> WatlowF4T:
        return WatlowF4T(self.bench.chamber, self.ports, self.clock)


class GyrostarRig(Rig):
    def make_driver(self) -> Gyrostar:
        return Gyrostar(self.bench.gyros[0], self.ports, self.clock)


PLACES: dict[str, tuple[type[Rig], str, str]] = {
    "f4": (F4Rig, "single-axis-sim", "sim://watlow-f4"),
    "f4t": (F4TRig, "triaxial-sim", "sim://watlow-f4t"),
    "gyrostar": (GyrostarRig, "gyrostar-sim", "sim://adam-6017/gyrostar"),
}


@pytest.fixture
def make_rig() -> Iterator[Callable[..., Any]]:
    """Make rigs by name, with what the bench file says changed; their links are closed at the end."""
    made: list[Rig] = []

    def make(
        kind: str, *, options: dict[str, Any] | None = None, simulated: dict[str, Any] | None = None, **chamber: Any
    ) -> Rig:
        rig, bench, url = PLACES[kind]
        made.append(rig(bench, url, chamber, options or {}, simulated or {}))
        return made[-1]

    yield make
    for rig in made:
        rig.close()


@pytest.fixture
def f4(make_rig: Callable[..., Any]) -> Any:
    return make_rig("f4")


@pytest.fixture
def f4t(make_rig: Callable[..., Any]) -> Any:
    return make_rig("f4t")


@pytest.fixture
def gyrostar(make_rig: Callable[..., Any]) -> Any:
    return make_rig("gyrostar")
