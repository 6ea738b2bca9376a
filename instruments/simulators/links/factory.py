"""Ports, Modbus clients and gRPC channels of simulated instruments, for the same libraries as those of hardware."""

from __future__ import annotations

from collections.abc import Callable

from instruments.clock import Clock
from instruments.simulators.links.device import SimulatedDevice, connected
from instruments.simulators.links.modbus_clients import SimulatedRtuClient, SimulatedTcpClient
from instruments.simulators.links.rpc_channel import SimulatedChannel
from instruments.simulators.links.serial_port import SimulatedSerialPort


class SimulatedLinks:
    """Links to the instruments that `device` returns by sim:// address. Every wait takes bench clock time."""

    def __init__(self, device: Callable[[str], SimulatedDevice], clock: Clock) -> None:
        self._device, self._clock = device, clock

    def serial_port(self, url: str, *, baudrate: int, timeout_s: float, line: object = None) -> SimulatedSerialPort:
        """Return an open port, whatever its line settings; raises LinkError for an unknown address."""
        del line
        return SimulatedSerialPort(connected(self._device(url)), self._clock, baudrate=baudrate, timeout=timeout_s)

    def port_timeout_s(self, timeout_s: float) -> float:
        """Return the time-out as it is: a simulated port waits on the bench clock."""
        return timeout_s

    def tcp_client(self, host: str, tcp_port: int, *, timeout_s: float) -> SimulatedTcpClient:  # noqa: ARG002  no port
        """Return a Modbus TCP client that is not connected yet; raises LinkError for an unknown address."""
        wall_s = self._clock.wall_s(timeout_s)
        return SimulatedTcpClient(self._device(host), self._clock, timeout_s, timeout=wall_s, retries=0)

    def rtu_client(self, url: str, *, baudrate: int, timeout_s: float, line: object = None) -> SimulatedRtuClient:
        """Return a Modbus RTU client that is not connected yet; raises LinkError for an unknown address."""
        del line
        wall_s = self._clock.wall_s(timeout_s)
        return SimulatedRtuClient(
            self._device(url), self._clock, timeout_s, baudrate=baudrate, timeout=wall_s, retries=0
        )

    def rpc_channel(self, host: str, tcp_port: int, *, timeout_s: float) -> SimulatedChannel:  # noqa: ARG002  no port
        """Return an open gRPC channel; raises LinkError for an unknown address, ImportError without grpcio."""
        return SimulatedChannel(self._device(host), self._clock, timeout_s)
