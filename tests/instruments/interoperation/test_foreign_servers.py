"""The drivers of chambers and of the Gyrostar with Modbus servers of other projects, over real terminals and TCP."""

from __future__ import annotations

import asyncio
import struct
import threading
from collections import deque
from collections.abc import Iterator
from typing import Any

import pytest
import serial
from modbus_tk import defines, modbus_rtu
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice
from pyModbusTCP.server import DataBank, ModbusServer

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock, SystemClock
from instruments.drivers.chambers.watlow_f4 import WatlowF4
from instruments.drivers.chambers.watlow_f4t import WatlowF4T
from instruments.drivers.gyrostar import Gyrostar
from instruments.drivers.resolution import resolve
from instruments.errors import LinkError
from instruments.simulators.links.real_ports import RealPorts
from instruments.transport.factory import Ports

#: modbus_tk asks its thread by the old name of the method.
pytestmark = pytest.mark.filterwarnings("ignore:isSet:DeprecationWarning")

PART_NUMBER = "F4T1A1A1A1A1A1A"
#: What an F4T has on its wire, typed here a third time: register -> words.
F4T: dict[int, list[int]] = {
    **{16 + n: [ord(letter)] for n, letter in enumerate(PART_NUMBER)},
    **{1356 + 100 * n: [61] for n in range(6)},
    90: [138], 2814: [10], 6730: [15], 16568: [1782],
}  # fmt: skip


def words_of(value: float) -> list[int]:
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return [low, high]


F4T |= {2774: words_of(-40.0), 2776: words_of(120.0), 2782: words_of(25.0), 2820: words_of(23.5)}


def bench_with(name: str, **changes: dict[str, Any]) -> BenchFile:
    record = read_bench(name).model_dump()
    for section, values in changes.items():
        target = record["gyros"][0] if section == "gyro" else record[section]
        target |= values
    return resolve(BenchFile.model_validate(record))


def f4t_at(port: int) -> WatlowF4T:
    clock = SystemClock()
    bench = bench_with("triaxial-sim", chamber={"host": "127.0.0.1", "tcp_port": port})
    return WatlowF4T(bench.chamber, Ports(clock), clock)  # type: ignore[arg-type]


def drives_an_f4t(driver: WatlowF4T) -> None:
    try:
        assert driver.identify() == f"Watlow {PART_NUMBER}"
        assert driver.set_temperature_c(85.1) == 85.1
        state = driver.read()
        assert (state.temperature_c, state.setpoint_c) == (23.5, 85.1)
        assert driver.make_safe() == 25.0
    finally:
        driver.close()


@pytest.fixture
def pymodbustcp() -> Iterator[tuple[ModbusServer, DataBank]]:
    bank = DataBank()
    server = ModbusServer("127.0.0.1", 0, no_block=True, data_bank=bank)
    server.start()
    yield server, bank
    server.stop()


def port_of(server: ModbusServer) -> int:
    return int(server._service.server_address[1])


def test_an_f4t_on_the_server_of_pymodbustcp(pymodbustcp: tuple[ModbusServer, DataBank]) -> None:
    server, bank = pymodbustcp
    for number, words in F4T.items():
        bank.set_holding_registers(number, words)
    # this server has every register; a limit module that is none reads 61 (none) everywhere
    for slot in range(6):
        for number in (11250, 11264, 11288):
            bank.set_holding_registers(number + 60 * slot, [61])
    drives_an_f4t(f4t_at(port_of(server)))


def test_a_gyrostar_on_the_server_of_pymodbustcp(pymodbustcp: tuple[ModbusServer, DataBank]) -> None:
    server, bank = pymodbustcp
    bank.set_input_registers(210, [0x6017])
    bank.set_input_registers(200, [0x0147] * 2)
    bank.set_input_registers(0, [32768, 40000])
    clock = SystemClock()
    bench = bench_with("gyrostar-sim", gyro={"host": "127.0.0.1", "tcp_port": port_of(server)})
    gyro = Gyrostar(bench.gyros[0], Ports(clock), clock)  # type: ignore[arg-type]
    try:
        gyro.identify()
        gyro.start()
        readings = gyro.read_latest()
        assert (readings.raw["gyro_z"][0], readings.raw["temperature_c"][0]) == (32768, 40000)
    finally:
        gyro.stop()


@pytest.fixture
def pymodbus() -> Iterator[int]:
    """A pymodbus server with an F4T's registers, in a thread with a loop of its own; its TCP port."""
    loop, started, found = asyncio.new_event_loop(), threading.Event(), []

    async def serve() -> Any:
        cells = [SimData(number, values=words, datatype=DataType.REGISTERS) for number, words in sorted(F4T.items())]
        server = ModbusTcpServer(SimDevice(1, simdata=cells), address=("127.0.0.1", 0))
        await server.serve_forever(background=True)
        found.append(server.transport.sockets[0].getsockname()[1])
        started.set()
        return server

    def run() -> None:
        asyncio.set_event_loop(loop)
        server = loop.run_until_complete(serve())
        loop.run_forever()
        loop.run_until_complete(server.shutdown())
        loop.close()

    thread = threading.Thread(target=run)
    thread.start()
    assert started.wait(10)
    yield found[0]
    loop.call_soon_threadsafe(loop.stop)
    thread.join(10)


def test_an_f4t_on_the_server_of_pymodbus(pymodbus: int) -> None:
    drives_an_f4t(f4t_at(pymodbus))


@pytest.fixture
def wire() -> Iterator[tuple[str, str]]:
    """Two terminals that are joined: what goes in at one comes out at the other."""
    ports, queues = RealPorts(), (deque[bytes](), deque[bytes]())

    def exchange(mine: int, data: bytes) -> bytes:
        queues[1 - mine].append(data)
        return b"".join(queues[mine].popleft() for _ in range(len(queues[mine])))

    yield tuple(ports.open_terminal(lambda data, mine=mine: exchange(mine, data)) for mine in (0, 1))  # type: ignore[misc]
    ports.close()


def f4_at(port: str, **chamber: Any) -> WatlowF4:
    clock = ScaledClock(1.0)
    bench = bench_with("single-axis-sim", chamber={"port": port, **chamber})
    return WatlowF4(bench.chamber, Ports(clock), clock)  # type: ignore[arg-type]


@pytest.mark.parametrize("function", [6, 16])
def test_an_f4_on_the_server_of_modbus_tk(wire: tuple[str, str], function: int) -> None:
    line = serial.Serial(wire[1], 19200)
    server = modbus_rtu.RtuServer(line)
    slave = server.add_slave(1)
    slave.add_block("all", defines.HOLDING_REGISTERS, 0, 2100)
    for number, words in {
        0: [5270], 100: [0xFF23, 0, 1, 0, 0, 0, 0], 200: [0, 0], 300: [250], 602: [65136], 603: [1200], 606: [1],
        608: [0], 901: [1],
    }.items():  # fmt: skip
        slave.set_values("all", number, words)
    server.start()
    driver = f4_at(wire[0], write_function=function)
    try:
        assert driver.identify() == "Watlow F4, steps of 0.1 deg C"
        assert driver.set_temperature_c(-22.1) == -22.1
        assert slave.get_values("all", 300, 1) == (65536 - 221,)
        state = driver.read()
        assert (state.temperature_c, state.setpoint_c, state.alarms) == (-22.1, -22.1, ("alarm 1 high",))
    finally:
        driver.close()
        server.stop()
        line.close()


def test_a_server_for_another_unit_is_silent(wire: tuple[str, str]) -> None:
    line = serial.Serial(wire[1], 19200)
    server = modbus_rtu.RtuServer(line)
    server.add_slave(7).add_block("all", defines.HOLDING_REGISTERS, 0, 10)
    server.start()
    clock = ScaledClock(50.0)
    bench = bench_with("single-axis-sim", chamber={"port": wire[0]})
    driver = WatlowF4(bench.chamber, Ports(clock), clock)  # type: ignore[arg-type]
    try:
        with pytest.raises(
            LinkError, match=r"chamber: .*check that the program at the other end of this .* and address 1"
        ):
            driver.identify()
    finally:
        driver.close()
        server.stop()
        line.close()
