"""Analog gyros through nidaqmx itself, on a simulated device behind NI's gRPC device server; no hardware was tried."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import nidaqmx
import numpy as np
import pytest
from nidaqmx._stubs import nidaqmx_pb2
from pydantic import ValidationError

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.errors import LinkError, NoReply, WrongInstrument
from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx.service import Status
from instruments.simulators.links.rpc_blocks import take_call
from tests.helpers.tap import Tap

HOST = "sim://nidaq/fog"


@pytest.fixture
def daq(stand: Callable[..., Any]) -> Callable[..., Any]:
    """Make a bench with a gyro on a device, and a tap on the wire to its server."""

    def make(rate_hz: float = 2000.0, terminals: str = "default", **options: Any) -> Any:
        gyro = {"driver": "nidaq", "port": None, "host": HOST, "device": "Dev2", "terminals": terminals}
        s = stand("single-axis-sim", gyro={**gyro, "sample_rate_hz": rate_hz, "options": options})
        wire = s.bench.simulation.device(HOST)
        s.server = wire._device
        s.tap = s.bench.simulation._devices[HOST] = Tap(wire)
        return s

    return make


def heard(tap: Tap, method: str) -> list[Any]:
    """Return the requests of a method, parsed by the stubs of nidaqmx."""
    calls = [found[0] for block in tap.heard if (found := take_call(block)) is not None]
    parse = getattr(nidaqmx_pb2, f"{method}Request").FromString
    return [parse(call.message) for call in calls if call.path == f"/nidaqmx_grpc.NiDAQmx/{method}"]


def test_what_nidaqmx_is_asked_for(daq: Callable[..., Any]) -> None:
    s = daq(average=20, thermometer_input=4, differential=True, range_v=5.0)
    found = s.gyro.identify()
    channels = [
        (each.physical_channel, each.terminal_config_raw, each.min_val, each.max_val)
        for each in heard(s.tap, "CreateAIVoltageChan")
    ]
    assert channels == [("Dev2/ai0", 10106, -5.0, 5.0), ("Dev2/ai4", 10106, -5.0, 5.0)]
    (clock,) = heard(s.tap, "CfgSampClkTiming")
    assert (clock.rate, clock.sample_mode_raw, clock.samps_per_chan) == (2000.0, 10123, 60000)
    assert found.reported == {"inputs": "USB-6341 Dev2"}
    assert s.server.tasks == {}


@pytest.mark.parametrize(("terminals", "number"), [("default", -1), ("rse", 10083), ("nrse", 10078)])
def test_terminals(daq: Callable[..., Any], terminals: str, number: int) -> None:
    s = daq(terminals=terminals)
    s.gyro.start()
    assert [each.terminal_config_raw for each in heard(s.tap, "CreateAIVoltageChan")] == [number]


@pytest.mark.parametrize("version", [(26, 0, 0), (23, 8, 0)])
def test_every_scan_is_in_a_reading(daq: Callable[..., Any], version: tuple[int, int, int]) -> None:
    """Driver software before 24.5 is asked in another way how many scans there are."""
    s = daq(average=20, thermometer_input=4)
    s.server.version = version
    s.server.inputs.volts = {0: 2.61234567, 4: 2.0}
    s.server.inputs.clock_ppm = 100.0
    s.gyro.start()
    s.gyro.read_latest()
    parts = [s.gyro.read(1.0) for _ in range(60)]
    times = np.concatenate([part.t_s for part in parts])
    arrival_s = np.concatenate([part.arrival_s for part in parts if part.arrival_s is not None])
    assert len(np.unique(arrival_s)) == 60  # with the buffer that they were in
    assert (arrival_s >= times - 1e-9).all()
    assert sum(part.lost for part in parts) == 0
    assert len(times) == pytest.approx(6000, abs=3)
    assert np.diff(times) == pytest.approx(0.01, abs=0.0006)  # within one scan
    rate, warm = s.gyro.channels
    step_v = 20 / 65536
    assert rate.value(parts[0].raw["gyro_z"]) == pytest.approx(round(2.61234567 / step_v) * step_v, abs=1e-7)
    assert warm.value(parts[0].raw["temperature_c"]) == pytest.approx(15.0, abs=20 * step_v)


def test_the_rate_of_a_turning_table_in_volts(daq: Callable[..., Any]) -> None:
    s = daq(average=20)
    s.gyro.start()
    means = []
    for rate_dps in (20.0, -20.0):
        spin = s.bench.table.spin(rate_dps, 6.0)
        s.gyro.read_latest()
        means.append(s.gyro.channels[0].value(s.gyro.read(4.0).raw["gyro_z"]).mean())
        s.bench.table.settle(spin)
    assert (means[0] - means[1]) / 0.022 == pytest.approx(40.0, rel=0.02)


def test_a_buffer_that_ran_over_is_an_error_in_one_line(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.clock.sleep(31.0)
    with pytest.raises(
        LinkError, match=r"^fog: cannot read the scans of Dev2 at .* \(error -200279: The application is"
    ):
        s.gyro.read(0.1)
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1


def test_volts_at_the_end_of_the_range_are_not_valid(daq: Callable[..., Any]) -> None:
    s = daq(average=10)
    s.server.inputs.volts = {0: 10.0}
    s.gyro.start()
    readings = s.gyro.read(0.5)
    assert len(readings)
    assert not readings.valid.any()


def test_failures_of_nidaqmx(daq: Callable[..., Any]) -> None:
    s = daq()
    s.server.inputs.rate_hz = 1950.0
    with pytest.raises(
        WrongInstrument, match="scans 1950 times per second, but the bench file states 2000; set sample_rate_hz = 1950"
    ):
        s.gyro.start()
    s.server.inputs.rate_hz = None
    s.gyro.start()
    s.server.failure = Status.DEVICE_UNKNOWN
    with pytest.raises(LinkError, match=r"error -200220: Device identifier is invalid\. Status Code: -200220\)"):
        s.gyro.read(0.1)
    with pytest.raises(LinkError, match="were not started; start them first"):
        s.gyro.read(0.1)
    assert s.server.tasks == {}
    s.gyro.stop()
    s.gyro.stop()


def test_what_the_device_does_not_have(daq: Callable[..., Any]) -> None:
    s = daq(inputs=[80])
    with pytest.raises(LinkError, match=r"cannot start the scans of Dev2 at .* \(error -200170: Physical channel"):
        s.gyro.start()
    s = daq()
    s.server.inputs.device = "Dev1"
    with pytest.raises(LinkError, match=r"error -200220: Device identifier .* check device name, cable and the driver"):
        s.gyro.start()


def test_a_silent_server(daq: Callable[..., Any]) -> None:
    s = daq()
    s.gyro.start()
    s.faults(HOST).arm("silence")
    asked_s = s.clock.now_s()
    with pytest.raises(
        NoReply, match=r"NI's gRPC device server does not answer \(StatusCode.DEADLINE_EXCEEDED.* check"
    ):
        s.gyro.read(0.1)
    assert s.clock.now_s() - asked_s < 6.0


def test_a_task_from_before_the_link_was_lost_is_cleared(daq: Callable[..., Any]) -> None:
    """It would keep the device: NI's server ends no task because its client has gone."""
    s = daq()
    s.gyro.start()
    s.faults(HOST).arm("dropped_link", count=1)
    with pytest.raises(NoReply):
        s.gyro.read(0.1)
    assert list(s.server.tasks) == ["labctl_Dev2_" + s.file.gyros[0].serial.replace("-", "_")]
    s.gyro.start()
    assert len(s.gyro.read_latest()) == 1
    assert len(s.server.tasks) == 1
    assert [each.initialization_behavior for each in heard(s.tap, "CreateTask")] == [1, 1, 2, 1]


def test_a_device_that_another_program_uses(daq: Callable[..., Any]) -> None:
    s = daq()
    channel = s.bench.gyros["fog"]._task._ports.rpc_channel(HOST, 0, device="x", timeout_s=1.0)
    with nidaqmx.Task(grpc_options=nidaqmx.GrpcSessionOptions(channel, "")) as other:
        other.ai_channels.add_ai_voltage_chan("Dev2/ai0")
        other.timing.cfg_samp_clk_timing(1000.0, sample_mode=nidaqmx.constants.AcquisitionType.CONTINUOUS)
        other.start()
        with pytest.raises(LinkError, match="error -50103: The specified resource is reserved"):
            s.gyro.start()
    s.gyro.start()


def test_a_device_at_this_computer(daq: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Without `host` the task is made without a server; here another one is put in its place."""
    s = daq(average=10)
    channel = s.gyro._task._ports.rpc_channel(HOST, 0, device="x", timeout_s=1.0)
    options, task = nidaqmx.GrpcSessionOptions(channel, ""), nidaqmx.Task
    monkeypatch.setattr(nidaqmx, "Task", lambda: task(grpc_options=options))
    s.gyro._task._settings = NidaqSettings.model_validate(s.gyro.settings.model_dump() | {"host": None})
    s.gyro.start()
    assert len(s.gyro.read(1.0)) == pytest.approx(200, abs=1)
    assert list(s.server.tasks) == ["session1"]
    s.clock.sleep(31.0)
    with pytest.raises(
        LinkError, match=r"scans of Dev2 \(error -200279: .*; check device name, cable and driver software"
    ):
        s.gyro.read(0.1)
    assert s.server.tasks == {}


def bench_with(**gyro: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    kept = {"name": "fog", "driver": "nidaq", "serial": "A1", "max_rate_dps": 90}
    return BenchFile.model_validate(record | {"gyros": [kept | gyro]})


@pytest.mark.parametrize(
    ("host", "missing", "text"),
    [
        (None, "nidaqmx", r"the package nidaqmx is not installed; run `pip install labctl\[nidaq\]`"),
        (HOST, "nidaqmx", r"the package nidaqmx is not installed; run `pip install labctl\[nidaq-grpc\]`"),
        (HOST, "grpc", r"nidaqmx needs the module grpc, which is not installed; run `pip install labctl\[nidaq-grpc"),
    ],
)
def test_a_package_that_is_not_installed(
    monkeypatch: pytest.MonkeyPatch, host: str | None, missing: str, text: str
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "nidaqmx"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    bench = open_bench(bench_with(host=host), VirtualClock())
    with pytest.raises(LinkError, match=text):
        bench.gyros["fog"].start()
    bench.close()


def test_nothing_is_imported_once_the_bench_is_open(daq: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "nidaqmx._grpc_interpreter")
    s = daq()
    before = set(sys.modules)
    s.gyro.identify()
    assert [name for name in set(sys.modules) - before if not name.startswith("numpy")] == []  # numpy loads itself late
    assert "nidaqmx._grpc_interpreter" in before


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"host": "grpc://daq.lab:31763/Dev1"}, "is not a network address; give the name or the IP address alone"),
        ({"port": "/dev/ttyUSB0"}, "key port is not used; give the network address of NI's gRPC device server as host"),
        ({"host": "daq.lab", "tcp_port": 0}, "greater than or equal to 1"),
    ],
)
def test_settings_that_are_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        open_bench(bench_with(**given), VirtualClock())


def test_where_a_device_is() -> None:
    required = {"driver": "nidaq", "name": "fog", "serial": "A1", "max_rate_dps": 90}
    addresses = [
        NidaqSettings.model_validate(required | given).address
        for given in (
            {},
            {"host": "daq.lab"},
            {"host": "daq.lab", "tcp_port": 9000, "device": "cDAQ1Mod1"},
            {"host": HOST},
        )
    ]
    assert addresses == ["Dev1", "Dev1 at daq.lab:31763", "cDAQ1Mod1 at daq.lab:9000", f"Dev1 at {HOST}"]
