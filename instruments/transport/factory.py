"""Opening a serial port or a Modbus link by address. `sim://` leads to a simulated instrument, by the same library.

This is the only file of the runtime that knows where the simulators are.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import serial
from pymodbus.client import ModbusSerialClient, ModbusTcpClient

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from instruments.errors import LinkError
from instruments.simulators.device import SimulatedDevice
from instruments.transport import modbus
from instruments.transport.serial import BROKEN

if TYPE_CHECKING:
    from instruments.simulators.links.faults import Faults

SIMULATED = "sim://"
NOT_OPENED: tuple[type[Exception], ...] = (*BROKEN, ValueError)


class Simulation(Protocol):
    """The simulated instruments of one bench, by address, and the world they stand in."""

    world: Any

    def device(self, url: str) -> SimulatedDevice:
        """Return the instrument at a sim:// address, always the same one."""
        ...

    def faults(self, url: str) -> Faults:
        """Return the faults that can be armed in the instrument at a sim:// address."""
        ...


def open_simulation(bench: BenchFile, clock: Clock) -> Simulation:
    """Return the simulated instruments of a bench."""
    from instruments.simulators.bench import SimulatedBench  # noqa: PLC0415  a real bench never loads the simulators

    return SimulatedBench(bench, clock)


def serve_simulation(
    bench: BenchFile,
    clock: Clock,
    out: Path | None,
    ready: Callable[[dict[str, str]], None],
    log: Path | None = None,
) -> None:
    """Put a bench's simulated instruments on real pseudo-terminals and TCP ports, until interrupted."""
    from instruments.simulators.links.server import serve  # noqa: PLC0415  a real bench never loads the simulators

    serve(bench, clock, out, ready, log)


class Ports:
    """Opens the links of one bench."""

    def __init__(self, clock: Clock, simulation: Simulation | None = None) -> None:
        self.clock = clock
        self.simulation = simulation

    def serial(self, url: str, *, device: str, baudrate: int, timeout_s: float) -> serial.SerialBase:
        """Open a serial port for this process alone, 8 data bits, no parity, one stop bit.

        Raises LinkError naming port and remedy, also while another process has the port open.
        """
        if url.startswith(SIMULATED):
            from instruments.simulators.links.serial_port import SimSerial  # noqa: PLC0415

            return SimSerial(self._simulated(url, device), self.clock, baudrate=baudrate, timeout=timeout_s)
        try:
            wall_s = self.clock.wall_s(timeout_s)
            return serial.serial_for_url(url, baudrate=baudrate, timeout=wall_s, write_timeout=wall_s, exclusive=True)
        except NOT_OPENED as error:
            raise LinkError(
                device, f"port {url} cannot be opened ({error}); check the cable, the port's name and who else uses it"
            ) from error

    def modbus_tcp(self, host: str, tcp_port: int, *, device: str, timeout_s: float) -> ModbusTcpClient:
        """Open a Modbus TCP link; raises LinkError naming host and remedy."""
        simulated = self._simulated(host, device) if host.startswith(SIMULATED) else None
        return modbus.connect_tcp(host, tcp_port, device=device, clock=self.clock, timeout_s=timeout_s, at=simulated)

    def modbus_rtu(self, url: str, *, device: str, baudrate: int, timeout_s: float) -> ModbusSerialClient:
        """Open a Modbus RTU link on a serial port; raises LinkError naming port and remedy."""
        simulated = self._simulated(url, device) if url.startswith(SIMULATED) else None
        return modbus.connect_rtu(
            url, baudrate=baudrate, device=device, clock=self.clock, timeout_s=timeout_s, at=simulated
        )

    def _simulated(self, url: str, device: str) -> SimulatedDevice:
        if self.simulation is None:
            raise LinkError(device, f"{url} is a simulated instrument, but this bench has no simulation")
        return self.simulation.device(url)


def hidden_defaults() -> dict[str, float]:
    """Return every effect that can be hidden in a simulated unit, with a size that a person would notice."""
    from instruments.simulators.hidden import EFFECTS  # noqa: PLC0415  a real bench never loads the simulators

    return {effect_id: kind.default for effect_id, kind in EFFECTS.items()}
