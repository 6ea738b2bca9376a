"""Modbus clients of other projects read and write the simulated instruments over real terminals and TCP ports."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator
from typing import Any

import minimalmodbus
import pytest
import serial
from modbus_tk import defines, modbus_rtu, modbus_tcp
from pyModbusTCP.client import ModbusClient
from umodbus.client import tcp as umodbus_tcp
from umodbus.client.serial import rtu as umodbus_rtu

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import SystemClock
from instruments.simulators.server import SimulationServer
from tests.helpers.patience import WAIT_S


def served(name: str) -> Iterator[tuple[BenchFile, Any]]:
    server = SimulationServer(read_bench(name), SystemClock())
    try:
        yield server.start(), server
    finally:
        server.stop()


@pytest.fixture
def f4() -> Iterator[tuple[str, Any]]:
    for bench, server in served("single-axis-sim"):
        yield bench.chamber.port or "", server._simulated.device("sim://watlow-f4")._device


@pytest.fixture
def f4t() -> Iterator[tuple[int, Any]]:
    for bench, server in served("triaxial-sim"):
        yield bench.chamber.tcp_port, server._simulated.device("sim://watlow-f4t")._device


@pytest.fixture
def adam() -> Iterator[tuple[int, Any]]:
    for bench, server in served("gyrostar-sim"):
        yield bench.gyros[0].tcp_port, server._simulated.device("sim://adam-6017/gyrostar")._device


def words_of(value: float) -> list[int]:
    """Return a float as an F4T has it: low word first."""
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return [low, high]


def test_minimalmodbus_and_an_f4(f4: tuple[str, Any]) -> None:
    port, simulated = f4
    instrument = minimalmodbus.Instrument(port, 1)
    assert instrument.serial is not None
    instrument.serial.timeout = WAIT_S
    try:
        assert instrument.read_register(0) == 5270
        assert instrument.read_register(100, 1, signed=True) == pytest.approx(25.0, abs=0.2)
        assert len(instrument.read_registers(100, 7)) == 7
        instrument.write_register(300, -22.1, 1, functioncode=6, signed=True)
        assert simulated.setpoint == -221
        instrument.write_register(300, 40.0, 1, functioncode=16, signed=True)
        assert instrument.read_register(300, 1, signed=True) == 40.0
        instrument.serial.timeout = 0.3  # it waits for the bytes of a reply without error
        with pytest.raises(minimalmodbus.IllegalRequestError):
            instrument.read_register(5000)
    finally:
        instrument.serial.close()


def test_modbus_tk_and_an_f4(f4: tuple[str, Any]) -> None:
    port, simulated = f4
    with serial.Serial(port, 19200) as line:
        master = modbus_rtu.RtuMaster(line)
        master.set_timeout(WAIT_S)
        assert master.execute(1, defines.READ_HOLDING_REGISTERS, 606, 1) == (1,)
        assert master.execute(1, defines.WRITE_SINGLE_REGISTER, 300, output_value=400) == (300, 400)
        assert master.execute(1, defines.READ_INPUT_REGISTERS, 300, 1) == (400,)
        assert simulated.setpoint == 400


def test_umodbus_and_an_f4(f4: tuple[str, Any]) -> None:
    port, simulated = f4
    with serial.Serial(port, 19200, timeout=WAIT_S) as line:
        assert umodbus_rtu.send_message(umodbus_rtu.read_holding_registers(1, 602, 2), line) == [65136, 1200]
        assert umodbus_rtu.send_message(umodbus_rtu.write_multiple_registers(1, 300, [410]), line) == 1
        assert simulated.setpoint == 410


def test_pymodbustcp_and_an_f4t(f4t: tuple[int, Any]) -> None:
    port, simulated = f4t
    client = ModbusClient("127.0.0.1", port, unit_id=1, timeout=WAIT_S, auto_close=False)
    try:
        assert client.read_holding_registers(16, 3) == [ord(letter) for letter in "F4T"]
        assert client.read_holding_registers(2782, 2) == words_of(25.0)
        assert client.write_multiple_registers(2782, words_of(85.1))
        assert simulated.setpoint_c == pytest.approx(85.1, abs=1e-5)
        assert client.read_holding_registers(9999, 1) is None
        assert client.last_except == 2
    finally:
        client.close()


def test_modbus_tk_and_an_adam(adam: tuple[int, Any]) -> None:
    port, _ = adam
    master = modbus_tcp.TcpMaster("127.0.0.1", port, timeout_in_sec=WAIT_S)
    try:
        assert master.execute(1, defines.READ_INPUT_REGISTERS, 210, 1) == (0x6017,)
        codes = master.execute(1, defines.READ_INPUT_REGISTERS, 0, 8)
        assert codes[0] * 5 / 65535 == pytest.approx(2.5, abs=0.3)  # 2.5 V at rest
    finally:
        master.close()


def test_umodbus_and_an_adam(adam: tuple[int, Any]) -> None:
    port, _ = adam
    with socket.create_connection(("127.0.0.1", port), timeout=WAIT_S) as line:
        assert umodbus_tcp.send_message(umodbus_tcp.read_input_registers(1, 200, 2), line) == [0x0147, 0x0147]
