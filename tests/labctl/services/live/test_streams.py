"""Streams by wire: a pipe, a TCP server, and a simulated gyro by its driver."""

from __future__ import annotations

import os
import socket

import numpy as np
import pytest

from instruments.clock import VirtualClock
from labctl.errors import BadInput
from labctl.fitting.live import LiveCalibration, LiveState
from labctl.recording.line_stream import LineDecoder
from labctl.services.live.feeds import feed_of
from labctl.services.live.gyro_source import GyroSource, bench_of_driver
from labctl.services.live.line_feed import DescriptorFeed, TcpFeed
from labctl.services.live.line_source import LineSource, info_of
from labctl.services.planning.loading import load_bench


def test_a_pipe_gives_what_has_arrived_and_its_end() -> None:
    read_end, write_end = os.pipe()
    feed = DescriptorFeed(read_end, "pipe")
    feed.open()
    try:
        assert feed.take() == b""
        os.write(write_end, b"1,2\n3")
        assert feed.take() == b"1,2\n3"
        os.write(write_end, b",4\n")
    finally:
        os.close(write_end)
    assert feed.take() == b",4\n"
    assert feed.take() is None
    os.close(read_end)


def test_a_server_gives_what_it_has_sent_and_its_end() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        feed = TcpFeed(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        feed.open()
        peer, _ = server.accept()
        assert feed.take() == b""
        with peer:
            peer.sendall(b"1,2\n")
        data = b""
        while (part := feed.take()) is not None:  # ends with the connection
            data += part
        assert data == b"1,2\n"
        feed.close()
        feed.close()


def test_a_server_that_is_not_there_is_said() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(BadInput, match=rf"^tcp://127.0.0.1:{port}: cannot connect .* check address"):
        feed_of(f"tcp://127.0.0.1:{port}", "").open()


def test_lines_have_the_time_of_their_arrival() -> None:
    read_end, write_end = os.pipe()
    clock = VirtualClock()
    source = LineSource(DescriptorFeed(read_end, "pipe"), LineDecoder(), info_of("P-1", clock, None), clock)
    source.start()
    header = ",".join(["t_s", *(f"gyro_{a}_dps" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz")])
    lines = [f"{7 + 0.1 * k:.1f},0,0,0,0,0,1" for k in range(9)]
    blocks = []
    for part in ([header, *lines[:3]], lines[3:4], [], lines[4:]):
        os.write(write_end, "".join(f"{line}\n" for line in part).encode())
        blocks.append(source.read(0.25).columns)
    os.close(write_end)
    os.close(read_end)
    arrivals = [block["arrival_s"].tolist() for block in blocks if block]
    # the third line arrived as it was made, for all that is known; the others with the read that found them
    assert np.concatenate(arrivals) == pytest.approx([0.2] * 3 + [0.45] + [0.95] * 5)
    assert np.concatenate([block["device_s"] for block in blocks if block]) == pytest.approx(7 + 0.1 * np.arange(9))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


def test_datagrams_are_lines_of_one_sender_and_what_is_lost_is_counted() -> None:
    port, clock = free_port(), VirtualClock()
    columns = ("t_s", *(f"gyro_{a}_dps" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz"))
    source = LineSource(feed_of(f"udp://:{port}", ""), LineDecoder(columns), info_of("U-1", clock, None), clock)
    source.start()
    lines = [f"{0.01 * k:.2f},0,0,0,0,0,1" for k in range(40)]
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        sender.sendto("\n".join(lines[:10]).encode(), ("127.0.0.1", port))  # no line end after the last
        first = source.read(0.1)
        other.sendto(b"9.0,0,0,0,0,0,1\n", ("127.0.0.1", port))
        for k in (10, 11, 15, 16, 17, 20):
            sender.sendto((lines[k] + "\n").encode(), ("127.0.0.1", port))
        then = source.read(0.1)
    source.stop()
    assert (len(first), first.lost, first.damaged) == (10, 0, 0)
    assert (len(then), then.lost, then.damaged) == (6, 3 + 2, 0)


def test_a_port_that_is_taken_and_an_address_that_is_none_are_said() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        feed = feed_of(f"udp://127.0.0.1:{taken.getsockname()[1]}", "")
        with pytest.raises(BadInput, match=r"cannot listen there.*a free port"):
            feed.open()
    with pytest.raises(BadInput, match="give udp://HOST:PORT"):
        feed_of("udp://127.0.0.1", "")


def test_a_simulated_gyro_by_driver_and_port() -> None:
    bench = bench_of_driver(
        "stream-format", "sim://stream-format/unit", "MTI-7", ["format=xsens-mti", "sample_rate_hz=100"], 48.0
    )
    source = GyroSource(bench, "MTI-7", VirtualClock())
    info = source.start()
    block = source.read(0.5)
    source.stop()
    assert (info.serial, info.motion, info.kind, info.latitude_deg) == ("MTI-7", "poses", "samples", 48.0)
    assert 45 <= len(block) <= 55
    assert block.columns["t_s"][0] == 0
    assert np.diff(block.columns["device_s"]) == pytest.approx(0.01, abs=1e-9)  # by the unit's own counter
    assert (block.columns["arrival_s"] >= block.columns["t_s"]).all()
    assert block.columns["arrival_s"][-1] < block.columns["t_s"][-1] + 0.5
    force = np.column_stack([block.columns[f"accel_{axis}_g"] for axis in "xyz"])
    assert np.linalg.norm(force, axis=1) == pytest.approx(np.ones(len(block)), abs=0.05)
    assert block.columns["valid"].all()


@pytest.fixture(scope="module")
def simulated() -> tuple[LiveCalibration, LiveState, np.ndarray]:
    """Return a live calibration of the shipped bench through its driver, and what is true of its unit."""
    clock = VirtualClock()
    source = GyroSource(load_bench("poses-sim"), None, clock)
    live = LiveCalibration(source.start())
    while True:
        block = source.read(0.5)
        live.add(block.columns, lost=block.lost, damaged=block.damaged)
        state = live.assess()
        source.ask(state.request)
        if state.done or clock.now_s() > 300:
            break
    simulation = source._bench.simulation
    assert simulation is not None
    truth = simulation.world.gyro("imu").truth.k(25.0) - np.eye(3)
    source.stop()
    return live, state, truth


@pytest.mark.slow
def test_the_simulated_person_completes_it(simulated: tuple[LiveCalibration, LiveState, np.ndarray]) -> None:
    live, state, _ = simulated
    assert state.done
    assert (state.lost, state.damaged) == (0, 0)
    assert live.info.latitude_deg == 42.28
    assert state.fit is not None
    assert state.fit.poses is not None
    assert state.fit.poses["moves"]["used"] >= state.fit.poses["moves"]["count"] - 1


def test_the_truth_of_the_simulated_unit_is_inside_u(
    simulated: tuple[LiveCalibration, LiveState, np.ndarray],
) -> None:
    _, state, truth = simulated
    z = []
    for each in state.coefficients:
        if each.limit is not None:
            i = "xyz".index(each.axis)
            j = i if each.name == "scale_factor" else "xyz".index(each.name[-1])
            z.append((each.value - truth[i, j]) / each.expanded)
    assert len(z) == 9
    assert np.max(np.abs(z)) < 1.5
    assert np.mean(np.abs(z) <= 1) >= 7 / 9
