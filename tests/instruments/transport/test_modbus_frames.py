"""Golden frames: what goes over the wire, byte by byte, with checksums computed here from the standard's polynomial."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

pytest_plugins = ["tests.helpers.modbus_rig"]


def crc16(data: bytes) -> bytes:
    """CRC-16/MODBUS, low byte first: polynomial 0x8005 reflected, seed 0xFFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return crc.to_bytes(2, "little")


def rtu(text: str) -> bytes:
    frame = bytes.fromhex(text)
    return frame + crc16(frame)


def test_the_checksum_is_the_standards() -> None:
    assert crc16(b"123456789") == bytes([0x37, 0x4B])
    assert rtu("01 03 0064 0001") == bytes.fromhex("01 03 00 64 00 01 C5 D5")


def test_f4_air_of_minus_22_1_c_on_the_wire(f4: Any) -> None:
    f4.simulated.sensor_code = -221
    state = f4.driver.read()
    # 100 to 106: the temperature, with input error and alarms
    assert (rtu("01 03 0064 0007"), rtu("01 03 0E FF23" + 6 * "0000")) in f4.tap.exchanges()
    assert (rtu("01 03 025E 0001"), rtu("01 03 02 0001")) in f4.tap.exchanges()  # 606: one decimal
    assert state.temperature_c == pytest.approx(-22.1, abs=1e-12)


@pytest.mark.parametrize(
    ("function", "request_frame", "reply"),
    [(6, "01 06 012C FF23", "01 06 012C FF23"), (16, "01 10 012C 0001 02 FF23", "01 10 012C 0001")],
)
def test_f4_set_point_of_minus_22_1_c_on_the_wire(
    make_rig: Callable[..., Any], function: int, request_frame: str, reply: str
) -> None:
    rig = make_rig("f4", write_function=function)
    assert rig.driver.set_temperature_c(-22.1) == pytest.approx(-22.1)
    assert (rtu(request_frame), rtu(reply)) in rig.tap.exchanges()
    assert (rtu("01 03 012C 0001"), rtu("01 03 02 FF23")) in rig.tap.exchanges()  # read back
    assert rig.simulated.setpoint == -221


def test_f4_exception_on_the_wire(f4: Any) -> None:
    f4.tap.receive(rtu("01 03 1234 0001"), 0.0)
    f4.tap.receive(rtu("01 05 0000 FF00"), 0.0)
    f4.tap.receive(rtu("01 06 012C 7FFF"), 0.0)
    assert f4.tap.transmit(0.0) == rtu("01 83 02") + rtu("01 85 01") + rtu("01 86 03")


def test_f4_is_deaf_to_other_addresses_and_broken_checksums(f4: Any) -> None:
    f4.tap.receive(rtu("02 03 0064 0001"), 0.0)
    f4.tap.receive(bytes.fromhex("01 03 0064 0001 C5 D4"), 0.0)
    assert f4.tap.transmit(0.0) == b""
    f4.tap.receive(rtu("01 03 0064 0001")[:3], 0.0)
    f4.tap.receive(rtu("01 03 0064 0001")[3:], 0.0)
    assert f4.tap.transmit(0.0) == rtu("01 03 02 00FA")


def test_f4t_air_and_set_point_on_the_wire(f4t: Any) -> None:
    f4t.driver.set_temperature_c(-22.1)
    sent = b"".join(f4t.tap.heard)
    # function 16 at 2782, two registers, four bytes: low word CCCD, high word C1B0
    assert bytes.fromhex("0000 000B 01 10 0ADE 0002 04 CCCD C1B0") in sent
    assert bytes.fromhex("0000 0006 01 10 0ADE 0002") in b"".join(f4t.tap.said)
    f4t.tap.forget()
    f4t.driver.read()
    request, reply = f4t.tap.exchanges()[0]
    assert request[2:] == bytes.fromhex("0000 0006 01 03 0B04 0002")
    assert reply[:2] == request[:2]
    assert reply[2:] == bytes.fromhex("0000 0007 01 03 04 0000 41C8")  # 25 deg C


def test_f4t_high_word_first_where_the_controller_is_set_so(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4t", word_order="big")
    rig.driver.set_temperature_c(-22.1)
    assert bytes.fromhex("10 0ADE 0002 04 C1B0 CCCD") in b"".join(rig.tap.heard)
    assert rig.simulated.setpoint_c == pytest.approx(-22.1, abs=1e-5)


def test_every_request_over_tcp_has_its_own_transaction_number(f4t: Any) -> None:
    f4t.driver.identify()
    f4t.driver.read()
    f4t.driver.close()
    f4t.driver.read()  # also over a link that was opened again
    numbers = [int.from_bytes(frame[:2], "big") for frame in f4t.tap.heard]
    assert numbers == list(range(1, len(numbers) + 1))


def test_adam_inputs_on_the_wire(gyrostar: Any) -> None:
    rig, gyro = gyrostar, gyrostar.driver
    gyro.identify()
    assert [frame[2:] for frame in rig.tap.heard] == [
        bytes.fromhex("0000 0006 01 04 00D2 0001"),
        bytes.fromhex("0000 0006 01 04 00C8 0001"),
        bytes.fromhex("0000 0006 01 04 00C9 0001"),
    ]
    assert [frame[-2:] for frame in rig.tap.said] == [bytes.fromhex(text) for text in ("6017", "0147", "0147")]
    rig.clock.sleep(1.0)
    readings = gyro.read_latest()
    assert rig.tap.heard[-1][2:] == bytes.fromhex("0000 0006 01 04 0000 0002")
    rate, temperature = int(readings.raw["gyro_z"][0]), int(readings.raw["temperature_c"][0])
    assert rig.tap.said[-1][2:] == bytes.fromhex(f"0000 0007 01 04 04 {rate:04X} {temperature:04X}")
