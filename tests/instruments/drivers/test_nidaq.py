"""Analog gyros through nidaqmx, with a module of the same calls in its place: no hardware has been tried."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from nidaqmx.constants import AcquisitionType, TerminalConfiguration
from nidaqmx.task import Task, Timing
from nidaqmx.task.collections import AIChannelCollection

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.analog.nidaq import NidaqGyro
from instruments.drivers.resolution import resolve
from instruments.errors import LinkError, WrongInstrument
from instruments.transport.factory import Ports
from tests.helpers.fake_nidaqmx import DaqError, FakeNidaqmx


@pytest.fixture
def daq(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Make a driver with the fake module behind it."""

    def make(rate_hz: float = 2000.0, **options: Any) -> Any:
        record = read_bench("single-axis-sim").model_dump()
        gyro = {"name": "fog", "driver": "nidaq", "serial": "A1", "max_rate_dps": 90, "device": "Dev2"}
        record["gyros"] = [{**gyro, "sample_rate_hz": rate_hz, "options": options}]
        settings: Any = resolve(BenchFile.model_validate(record)).gyros[0]
        clock = VirtualClock()
        module = FakeNidaqmx(clock)
        monkeypatch.setitem(sys.modules, "nidaqmx", module)
        driver: Any = NidaqGyro(settings, Ports(clock), clock)
        driver.module, driver.clock = module, clock
        return driver

    return make


def test_what_nidaqmx_is_asked_for(daq: Callable[..., Any]) -> None:
    gyro = daq(average=20, thermometer_input=4, differential=True, range_v=5.0)
    gyro.module.volts = {0: 2.6, 4: 2.0}
    found = gyro.identify()
    assert gyro.module.requests == [
        ("Dev2/ai0", 10106, -5.0, 5.0),
        ("Dev2/ai4", 10106, -5.0, 5.0),
        (2000.0, 10123, 60000),
    ]
    assert found.reported == {"inputs": "USB-6341 Dev2"}
    assert gyro.module.closed == 1


def test_every_scan_is_in_a_reading(daq: Callable[..., Any]) -> None:
    gyro = daq(average=20, thermometer_input=4)
    gyro.module.volts = {0: 2.61234567, 4: 2.0}
    gyro.module.ppm = 100.0
    gyro.start()
    gyro.read_latest()
    parts = [gyro.read(1.0) for _ in range(60)]
    times = np.concatenate([part.t_s for part in parts])
    assert sum(part.lost for part in parts) == 0
    assert len(times) == pytest.approx(6000, abs=3)
    assert np.diff(times) == pytest.approx(0.01, abs=0.0006)  # within one scan
    rate, warm = gyro.channels
    assert rate.value(parts[0].raw["gyro_z"]) == pytest.approx(2.6123457, abs=1e-9)
    assert warm.value(parts[0].raw["temperature_c"]) == pytest.approx(15.0)


def test_a_buffer_that_ran_over_is_an_error_in_one_line(daq: Callable[..., Any]) -> None:
    gyro = daq()
    gyro.start()
    gyro.clock.sleep(31.0)
    with pytest.raises(LinkError, match=r"^fog: cannot read the scans of Dev2 \(error -200279: The application is not"):
        gyro.read(0.1)
    gyro.start()
    assert len(gyro.read_latest()) == 1


def test_volts_at_the_end_of_the_range_are_not_valid(daq: Callable[..., Any]) -> None:
    gyro = daq(average=10)
    gyro.module.volts = {0: 10.0}
    gyro.start()
    assert not gyro.read(0.5).valid.any()


def test_failures_of_nidaqmx(daq: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    gyro = daq()
    gyro.module.rate_hz = 1950.0
    with pytest.raises(
        WrongInstrument, match="scans 1950 times per second, but the bench file states 2000; set sample_rate_hz = 1950"
    ):
        gyro.start()
    gyro.module.rate_hz = None
    gyro.start()
    gyro.module.failure = DaqError("Device identifier is invalid.", -200220)
    with pytest.raises(LinkError, match=r"error -200220: Device identifier is invalid\. Status Code: -200220\)"):
        gyro.read(0.1)
    with pytest.raises(LinkError, match="were not started; start them first"):
        gyro.read(0.1)
    gyro.stop()
    gyro.stop()
    monkeypatch.setitem(sys.modules, "nidaqmx", None)
    with pytest.raises(LinkError, match=r"nidaqmx is not installed; run `pip install labctl\[nidaq\]`"):
        gyro.start()


def test_the_fake_has_the_calls_of_the_real_package() -> None:
    """Names and parameters; the driver software of the maker is not needed for that."""
    known = inspect.signature(AIChannelCollection.add_ai_voltage_chan).parameters
    assert {"terminal_config", "min_val", "max_val"} <= set(known)
    assert {"rate", "sample_mode", "samps_per_chan"} <= set(inspect.signature(Timing.cfg_samp_clk_timing).parameters)
    assert {"number_of_samples_per_channel", "timeout"} <= set(inspect.signature(Task.read).parameters)
    assert isinstance(inspect.getattr_static(Timing, "samp_clk_rate"), property)
    assert TerminalConfiguration.DIFF.value == 10106
    assert AcquisitionType.CONTINUOUS.value == 10123
