"""The Gyrostar through an ADAM-6017's bytes: codes and volts, who answers, polling on the Clock, what is not valid."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from instruments.drivers.gyrostar import make_channels
from instruments.errors import LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.protocols.adam6017 import FULL_CODE, RANGES_V, WiringOptions
from instruments.simulators.devices.adam6017 import code_of

pytest_plugins = ["tests.helpers.modbus_rig"]


@pytest.mark.parametrize(
    ("range_code", "uv_per_code", "dps_per_code", "at_rest"),
    [(0x0143, 305.2, 0.0139, 40959), (0x0142, 152.6, 0.0069, 49151), (0x0147, 76.3, 0.0035, 32768)],
)
def test_codes_of_the_ranges(range_code: int, uv_per_code: float, dps_per_code: float, at_rest: int) -> None:
    (rate,) = make_channels("z", WiringOptions(range_code=range_code))
    assert rate.unit == "V"
    assert rate.scale * 1e6 == pytest.approx(uv_per_code, abs=0.05)
    assert rate.scale / 0.022 == pytest.approx(dps_per_code, abs=5e-5)
    assert abs(code_of(2.5, range_code) - at_rest) <= 1
    assert rate.value(np.array([at_rest]))[0] == pytest.approx(2.5, abs=rate.scale)


@pytest.mark.parametrize("range_code", RANGES_V)
def test_zero_is_the_low_end_and_65535_the_high_end(range_code: int) -> None:
    low, high = RANGES_V[range_code]
    channel = make_channels("z", WiringOptions(range_code=range_code))[0]
    assert channel.value(np.array([0, FULL_CODE])) == pytest.approx([low, high])
    assert [code_of(v, range_code) for v in (low - 1, low, high, high + 1)] == [0, 0, FULL_CODE, FULL_CODE]


def test_full_rate_is_within_the_recommended_range() -> None:
    volts = make_channels("z", WiringOptions())[0].value(
        np.array([code_of(2.5 + 0.022 * r, 0x0147) for r in (-90, 90)])
    )
    assert volts == pytest.approx([0.52, 4.48], abs=4e-5)


@pytest.mark.parametrize(
    "options",
    [
        {"range_code": 0x0180},  # a current
        {"channel": 8},
        {"channel": 2, "thermometer_channel": 2},
        {"chanel": 1},
    ],
)
def test_wrong_wiring_in_the_bench_file_is_refused(make_rig: Callable[..., Any], options: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        make_rig("gyrostar", options=options)


def test_making_the_driver_sends_nothing(gyrostar: Any) -> None:
    assert gyrostar.tap.heard == []
    assert gyrostar.ports.opened == []


def test_it_says_who_it_is_and_what_a_volt_means(gyrostar: Any) -> None:
    identity = gyrostar.driver.identify()
    assert (identity.serial, identity.technology) == ("GYROSTAR-0001", "piezo")
    assert identity.output == {"z": {"unit": "V", "offset": 2.5, "scale": 0.022}}
    assert [channel.name for channel in gyrostar.driver.channels] == ["gyro_z", "temperature_c"]


def test_another_module_is_refused(gyrostar: Any) -> None:
    gyrostar.simulated.module_name = 0x6024
    with pytest.raises(WrongInstrument, match=r"gyrostar: module name \(register 210\) is 0x6024 instead of 0x6"):
        gyrostar.driver.identify()


@pytest.mark.parametrize("channel", [0, 1])
def test_another_input_range_is_refused(gyrostar: Any, channel: int) -> None:
    gyrostar.simulated.ranges[channel] = 0x0143
    with pytest.raises(WrongInstrument, match=f"input {channel} has range code 0x0143, but the bench file says 0x0147"):
        gyrostar.driver.identify()


def test_ten_readings_a_second_on_the_clock(gyrostar: Any) -> None:
    gyro = gyrostar.driver
    gyrostar.clock.sleep(7.0)
    gyro.start()
    blocks = [gyro.read(1.0) for _ in range(60)]
    t_s = np.concatenate([block.t_s for block in blocks])
    assert gyrostar.clock.now_s() == pytest.approx(67.0)
    assert t_s == pytest.approx(7.0 + 0.1 * np.arange(601))
    assert sum(block.lost for block in blocks) == 0
    assert all(block.valid.all() for block in blocks)
    assert all(set(block.raw) == {"gyro_z", "temperature_c"} for block in blocks)


def test_a_turning_table_is_a_voltage(gyrostar: Any) -> None:
    """45 deg/s are 0.99 V more than rest; the unit's own scale is within half a percent of the data sheet's."""
    gyro, world = gyrostar.driver, gyrostar.world
    world.power(0.0, on=True)
    gyrostar.clock.sleep(600.0)
    gyro.start()
    rest = gyro.channels[0].value(gyro.read(20.0).raw["gyro_z"]).mean()
    begun_s = gyrostar.clock.now_s()
    world.table.start(begun_s, 200 * 60, 200.0, 90.0)  # 200 steps/s of 0.225 deg
    gyrostar.clock.sleep(5.0)
    turning = gyro.channels[0].value(gyro.read(40.0).raw["gyro_z"]).mean()
    assert (turning - rest) / 0.022 == pytest.approx(45.0, rel=0.005)


def test_the_thermometer_on_the_second_input(gyrostar: Any) -> None:
    gyro = gyrostar.driver
    gyrostar.clock.sleep(100.0)
    read_latest = gyro.read_latest()
    assert len(read_latest) == 1
    shown = gyro.channels[1].value(read_latest.raw["temperature_c"])[0]
    assert shown == pytest.approx(gyrostar.world.heat.sensor_c("gyrostar", np.array([100.0]))[0], abs=0.15)


def test_inputs_anywhere_on_the_module_and_no_thermometer(make_rig: Callable[..., Any]) -> None:
    far = make_rig("gyrostar", options={"channel": 6, "thermometer_channel": 3, "range_code": 0x0142})
    far.driver.identify()
    raw = far.driver.read_latest().raw
    assert far.tap.heard[-1][-4:] == bytes.fromhex("0003 0004")
    assert abs(int(raw["gyro_z"][0]) - 49151) < 500
    alone = make_rig("gyrostar", options={"channel": 5, "thermometer_channel": None, "read_function": 3})
    alone.driver.identify()
    assert set(alone.driver.read_latest().raw) == {"gyro_z"}
    assert alone.tap.heard[-1][-5:] == bytes.fromhex("03 0005 0001")


@pytest.mark.parametrize(("code", "valid"), [(0, False), (1, True), (65500, True), (65501, False), (65535, False)])
@pytest.mark.parametrize("channel", [0, 1])
def test_codes_at_the_rails_are_no_measurement(gyrostar: Any, channel: int, code: int, valid: bool) -> None:
    gyrostar.simulated._sample = lambda _t_s: None
    gyrostar.simulated.codes[:2] = [32768, 32768]
    gyrostar.simulated.codes[channel] = code
    readings = gyrostar.driver.read_latest()
    assert readings.valid.tolist() == [valid]
    assert readings.raw[gyrostar.driver.channels[channel].name].tolist() == [code]


def test_what_a_retry_delays_is_stamped_late_and_the_gap_counts_as_lost(gyrostar: Any) -> None:
    gyro = gyrostar.driver
    gyro.start()
    gyrostar.faults.arm("lost_reply", from_s=0.95, count=1)  # one time-out of 1 s and a pause of 0.1 s
    readings = gyro.read(4.0)
    assert np.all(np.diff(readings.t_s) > 0)
    assert readings.lost == 11 - 1
    assert len(readings) + readings.lost == 41
    gaps = np.diff(readings.t_s)
    assert gaps.max() == pytest.approx(1.1)
    assert np.delete(gaps, gaps.argmax()) == pytest.approx(0.1)


def test_a_pause_between_reads_is_not_lost(gyrostar: Any) -> None:
    gyro = gyrostar.driver
    gyro.start()
    gyro.read(1.0)
    gyrostar.clock.sleep(30.03)
    later = gyro.read(1.0)
    assert later.lost == 0
    assert 31.0 < later.t_s[0] < 31.15
    assert np.diff(later.t_s)[1:] == pytest.approx(0.1)


def test_a_link_that_dies_within_a_read_leaves_what_was_read(gyrostar: Any) -> None:
    gyro = gyrostar.driver
    gyro.start()
    gyrostar.faults.arm("silence", from_s=1.95)
    readings = gyro.read(4.0)
    assert readings.t_s[-1] == pytest.approx(1.9)
    assert len(readings) == 20
    assert readings.lost > 0
    with pytest.raises(NoReply, match=r"^gyrostar: no answer to read analog input 0 \(register 0\)"):
        gyro.read(1.0)


@pytest.mark.parametrize(
    ("kind", "error"),
    [("silence", NoReply), ("wrong_crc", MalformedReply), ("dropped_link", LinkError), ("merge", NoReply)],
)
def test_every_lasting_fault_names_the_unit(gyrostar: Any, kind: Any, error: Any) -> None:
    gyrostar.driver.identify()
    gyrostar.faults.arm(kind)
    for act in (gyrostar.driver.read_latest, lambda: gyrostar.driver.read(1.0), gyrostar.driver.identify):
        with pytest.raises(error, match=r"^gyrostar: "):
            act()
    assert gyrostar.clock.now_s() < 30
    gyrostar.faults.clear()
    assert len(gyrostar.driver.read_latest()) == 1


def test_an_exception_of_the_module_is_a_refusal(gyrostar: Any) -> None:
    gyrostar.faults.arm("modbus_exception", value=2)
    with pytest.raises(
        RequestRejected, match=r"gyrostar: refused to read module name \(register 210\): Modbus exception 2"
    ):
        gyrostar.driver.identify()


def test_stopping_twice_is_fine(gyrostar: Any) -> None:
    gyrostar.driver.start()
    gyrostar.driver.stop()
    gyrostar.driver.stop()
    assert len(gyrostar.driver.read_latest()) == 1


def test_the_same_seed_gives_the_same_bytes(make_rig: Callable[..., Any]) -> None:
    def bytes_of_a_minute() -> bytes:
        rig = make_rig("gyrostar")
        rig.driver.start()
        rig.driver.read(60.0)
        return b"".join(rig.tap.said)

    assert bytes_of_a_minute() == bytes_of_a_minute()
