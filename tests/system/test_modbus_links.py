"""The same drivers over a real pseudo-terminal and real TCP ports, against the simulators served beside them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

import pytest

from instruments.bench import checked_settings
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import Clock, ScaledClock, VirtualClock
from instruments.drivers.chambers.watlow_f4 import WatlowF4
from instruments.drivers.chambers.watlow_f4t import WatlowF4T
from instruments.drivers.gyrostar import Gyrostar
from instruments.errors import InstrumentError, LinkError, NoReply
from instruments.protocols.modbus_registers import Register
from instruments.simulators.server import SimulationServer
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers

SPEED = 10.0
AIR = Register(100, "air temperature", "int16", "counts")


@pytest.fixture
def serve() -> Iterator[Callable[[str], tuple[BenchFile, Clock, SimulationServer]]]:
    servers: list[SimulationServer] = []

    def start(name: str) -> tuple[BenchFile, Clock, SimulationServer]:
        clock = ScaledClock(SPEED)
        servers.append(SimulationServer(read_bench(name), clock))
        return checked_settings(servers[-1].start()), clock, servers[-1]

    yield start
    for server in servers:
        server.stop()


def test_an_f4_on_a_real_serial_port(serve: Callable[[str], tuple[BenchFile, Clock, SimulationServer]]) -> None:
    bench, clock, _ = serve("single-axis-sim")
    assert bench.chamber.port is not None
    assert not bench.chamber.port.startswith("sim:")
    chamber = WatlowF4(bench.chamber, Ports(clock), clock)
    try:
        assert chamber.identify().startswith("Watlow F4")
        assert chamber.set_temperature_c(-22.1) == pytest.approx(-22.1)
        assert chamber.read().setpoint_c == pytest.approx(-22.1)
    finally:
        chamber.close()


def test_an_f4t_and_an_adam_on_real_tcp(serve: Callable[[str], tuple[BenchFile, Clock, SimulationServer]]) -> None:
    bench, clock, server = serve("gyrostar-sim")
    chamber = WatlowF4T(bench.chamber, Ports(clock), clock)
    gyro = Gyrostar(bench.gyros[0], Ports(clock), clock)
    try:
        assert chamber.identify().startswith("Watlow F4T")
        assert chamber.set_temperature_c(40.0) == 40.0
        assert gyro.identify().serial == "GYROSTAR-0001"
        gyro.start()
        begun_s = clock.now_s()
        readings = gyro.read(3.0)
        assert 31 <= len(readings) + readings.lost <= 10 * (clock.now_s() - begun_s) + 2
        assert len(readings) > 0
        assert readings.valid.all()
        server.stop()
        with pytest.raises(LinkError):
            chamber.read()
        with pytest.raises(InstrumentError):
            gyro.read_latest()
    finally:
        chamber.close()
        gyro.stop()


@pytest.mark.slow
def test_a_real_port_on_which_nobody_answers_is_silence_too() -> None:
    ours, theirs = os.openpty()
    try:
        clock = VirtualClock()
        port = os.ttyname(theirs)
        registers = Registers(
            "chamber",
            1,
            clock,
            lambda: Ports(clock).modbus_rtu(port, device="chamber", baudrate=19200, timeout_s=1.0),
        )
        with pytest.raises(NoReply, match="no answer to read air temperature"):
            registers.get(AIR)
        registers.close()
    finally:
        os.close(ours)
        os.close(theirs)
