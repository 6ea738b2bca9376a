"""Analog gyros on a simulated device of Measurement Computing; test_mcc_uldaq.py drives the maker's package."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.errors import LimitError, LinkError, NoReply, WrongInstrument
from instruments.protocols.nidaqmx.rpc_status import RpcStatus
from instruments.protocols.uldaq_library import BIPOLAR_RANGES, TEXTS, UlError
from instruments.simulators.links.rpc_blocks import Call

HOST = "sim://mcc-daq/fog"


@pytest.fixture
def daq(stand: Callable[..., Any]) -> Callable[..., Any]:
    """Make a bench with a gyro on a simulated device."""

    def make(rate_hz: float = 500.0, **options: Any) -> Any:
        gyro = {"driver": "mcc-daq", "port": None, "host": HOST, "sample_rate_hz": rate_hz, "options": options}
        s = stand("single-axis-sim", gyro=gyro)
        s.device = s.bench.simulation.device(HOST)._device
        return s

    return make


def test_every_scan_is_in_a_reading(daq: Callable[..., Any]) -> None:
    s = daq(average=10, thermometer_input=4)
    s.device.volts = {0: 2.61234567, 4: 2.0}
    s.device.clock_ppm = 100.0
    s.gyro.start()
    s.gyro.read_latest()
    parts = [s.gyro.read(4.0) for _ in range(15)]
    times = np.concatenate([part.t_s for part in parts])
    assert sum(part.lost for part in parts) == 0
    assert len(times) == pytest.approx(3000, abs=3)
    assert np.diff(times) == pytest.approx(0.02, abs=0.0022)  # within one scan
    rate, warm = s.gyro.channels
    step_v = 20 / 65536
    assert rate.value(parts[0].raw["gyro_z"]) == pytest.approx(round(2.61234567 / step_v) * step_v, abs=1e-7)
    assert warm.value(parts[0].raw["temperature_c"]) == pytest.approx(15.0, abs=20 * step_v)


def test_the_rate_of_a_turning_table_in_volts(daq: Callable[..., Any]) -> None:
    s = daq(average=10)
    s.gyro.start()
    means = []
    for rate_dps in (20.0, -20.0):
        spin = s.bench.table.spin(rate_dps, 6.0)
        s.gyro.read_latest()
        means.append(s.gyro.channels[0].value(s.gyro.read(4.0).raw["gyro_z"]).mean())
        s.bench.table.settle(spin)
    assert (means[0] - means[1]) / 0.022 == pytest.approx(40.0, rel=0.02)


def test_failures_of_the_device(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.device.failure = UlError.DEAD_DEV
    with pytest.raises(LinkError, match=rf"cannot read the scans of {HOST} \(error 8: Device no longer responding\)"):
        s.gyro.read(0.1)
    s.device.failure, s.device.rate_hz = UlError.NO_ERROR, 450.0
    with pytest.raises(WrongInstrument, match="scans 450 times per second, but the bench file states 500"):
        s.gyro.start()
    assert s.device.scan is None


def test_a_scan_that_another_ended(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.device.scan = None
    with pytest.raises(LinkError, match="has ended its scans after 0 of them; check that no other program"):
        s.gyro.read(0.1)
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1


def test_what_the_device_does_not_have(daq: Callable[..., Any]) -> None:
    with pytest.raises(LimitError, match="input 16 is not one of the 16 single-ended inputs of USB-1608G"):
        daq(inputs=[16]).gyro.start()
    with pytest.raises(LimitError, match="choose one of 1, 2, 5, 10 as options"):
        daq(range_v=2.5).gyro.start()


def test_a_scan_from_before_the_link_was_lost_is_ended(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.faults(HOST).arm("silence", count=1)
    with pytest.raises(NoReply):
        s.gyro.read(0.1)
    assert s.device.scan is not None
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1


def test_a_silent_device(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.faults(HOST).arm("silence")
    asked_s = s.clock.now_s()
    with pytest.raises(NoReply, match=r"cannot read the scans of .*: no answer \(Deadline Exceeded\); check device"):
        s.gyro.read(0.1)
    assert s.clock.now_s() - asked_s < 6.0


def test_a_call_that_is_not_simulated(daq: Callable[..., Any]) -> None:
    device = daq().device
    assert device.answer(Call("/uldaq/ulAOut", b""), 0.0).status == RpcStatus.UNIMPLEMENTED
    assert device.answer(Call("/uldaq/ulAInScan", b"x"), 0.0).status == RpcStatus.INVALID_ARGUMENT


def test_each_range_has_its_own_number() -> None:
    assert sorted(BIPOLAR_RANGES.values()) == list(range(1, 25))
    assert {UlError.OVERRUN, UlError.DEAD_DEV} < set(TEXTS)
