"""nidaqmx and grpcio against the simulated device on a real TCP port, through a real gRPC server and channel."""

from __future__ import annotations

import socket
import time
from typing import Any

import nidaqmx
import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock
from instruments.errors import LinkError, NoReply
from instruments.protocols.nidaqmx.service import Status
from instruments.simulators.server import SimulationServer
from instruments.transport.rpc import TimedChannel, target


def bench_file(**gyro: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    given = {"driver": "nidaq", "port": None, "device": "Dev3", "sample_rate_hz": 1000}
    options = {"average": 10, "thermometer_input": 2}
    return BenchFile.model_validate(record | {"gyros": [record["gyros"][0] | given | {"options": options} | gyro]})


def test_the_driver_at_a_real_server() -> None:
    clock = ScaledClock(1.0)
    server = SimulationServer(bench_file(host="sim://nidaq/fog"), clock)
    try:
        file = server.start()
        assert (file.gyros[0].host, file.gyros[0].tcp_port) == ("127.0.0.1", int(server.addresses["fog"].split(":")[1]))
        bench = open_bench(file, clock)
        unit = bench.gyros["fog"]
        assert unit.identify().reported == {"inputs": "USB-6341 Dev3"}
        unit.start()
        unit.read_latest()
        readings = unit.read(0.5)
        assert readings.lost == 0
        assert len(readings) > 40  # more on a busy machine, which comes back later
        assert np.diff(readings.t_s) == pytest.approx(0.01, abs=1e-4)
        assert readings.valid.all()
        device: Any = server._simulated.device("sim://nidaq/fog")
        device._device.failure = Status.OVERRUN
        with pytest.raises(LinkError, match=r"at 127\.0\.0\.1:\d+ \(error -200279: The application is not able"):
            unit.read(0.1)
        assert device._device.tasks == {}
        bench.close()
    finally:
        server.stop()


def test_nidaqmx_alone_at_a_real_server() -> None:
    """What the driver does not do: a task without a name, and one input read by the number of samples."""
    clock = ScaledClock(1.0)
    server = SimulationServer(bench_file(host="sim://nidaq/fog"), clock)
    try:
        file = server.start()
        channel = TimedChannel("127.0.0.1", file.gyros[0].tcp_port, 5.0)
        with nidaqmx.Task(grpc_options=nidaqmx.GrpcSessionOptions(channel, "")) as task:
            task.ai_channels.add_ai_voltage_chan("Dev3/ai0", min_val=-10.0, max_val=10.0)
            task.timing.cfg_samp_clk_timing(1000.0, sample_mode=nidaqmx.constants.AcquisitionType.CONTINUOUS)
            task.start()
            assert [device.name for device in task.devices] == ["Dev3"]
            with pytest.raises(nidaqmx.DaqError, match="have not yet been acquired"):
                task.read(number_of_samples_per_channel=900, timeout=0.0)
            with pytest.raises(nidaqmx.errors.RpcError, match="not supported by the NI gRPC Device Server"):
                task.timing.samp_clk_src  # noqa: B018
        channel.close()
    finally:
        server.stop()


def closed_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@pytest.fixture
def silent_port() -> Any:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield int(listener.getsockname()[1])


def refusal(tcp_port: int) -> str:
    clock = ScaledClock(20.0)  # 5 s of the bench are 0.25 s
    bench = open_bench(bench_file(host="127.0.0.1", tcp_port=tcp_port), clock)
    before_s = time.monotonic()
    with pytest.raises(NoReply) as caught:
        bench.gyros["fog"].start()
    assert time.monotonic() - before_s < 5.0
    bench.gyros["fog"].stop()
    return str(caught.value)


def test_where_no_server_listens_and_where_one_is_silent(silent_port: int) -> None:
    for tcp_port in (closed_port(), silent_port):
        assert refusal(tcp_port).startswith(
            f"fog: cannot start the scans of Dev3 at 127.0.0.1:{tcp_port}: NI's gRPC device server does not answer ("
        )


def test_addresses() -> None:
    assert target("daq.lab", 31763) == "daq.lab:31763"
    assert target("fe80::1", 31763) == "[fe80::1]:31763"
    assert target("[::1]", 1) == "[::1]:1"
