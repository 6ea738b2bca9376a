"""Messages of a rosbridge server, as its protocol describes them, over a real WebSocket on this machine."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any

import pytest
from websockets.sync.server import Server, ServerConnection, serve

from instruments.clock import VirtualClock
from labctl.errors import BadInput
from labctl.recording import RecordingInfo
from labctl.recording.line_stream import LineDecoder
from labctl.services.live.feeds import RosbridgeFeed, network_feed
from labctl.services.live.line_source import LineSource
from labctl.services.live.source import StreamEnded
from tests.helpers.waiting import eventually

INFO = RecordingInfo(
    serial="ROS-1", axes=("x", "y", "z"), kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
)


def imu(k: int, topic: str = "/imu/data") -> dict[str, Any]:
    """Return a published sensor_msgs/msg/Imu: pi/180 rad/s about x, and one standard gravity along z."""
    stamp = {"sec": 1_700_000_000 + k // 100, "nanosec": (k % 100) * 10_000_000}
    return {
        "op": "publish",
        "topic": topic,
        "msg": {
            "header": {"stamp": stamp, "frame_id": "imu"},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
            "orientation_covariance": [-1.0] + [0.0] * 8,
            "angular_velocity": {"x": 0.017453292519943295, "y": 0.0, "z": -0.5},
            "angular_velocity_covariance": [0.0] * 9,
            "linear_acceleration": {"x": 0.0, "y": 4.903325, "z": 9.80665},
            "linear_acceleration_covariance": [0.0] * 9,
        },
    }


@contextmanager
def rosbridge(*messages: object) -> Iterator[tuple[str, list[Any]]]:
    """Give the address of a server that sends messages once a client has subscribed, then ends; and what it heard."""
    heard: list[Any] = []

    def answer(client: ServerConnection) -> None:
        heard.append(json.loads(client.recv()))
        for message in messages:
            client.send(message if isinstance(message, str) else json.dumps(message))

    server: Server = serve(answer, "127.0.0.1", 0)
    thread = threading.Thread(target=server.serve_forever, name="rosbridge")
    thread.start()
    try:
        yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}", heard
    finally:
        server.shutdown()
        thread.join()


def lines_of(feed: RosbridgeFeed) -> bytes:
    """Return all that a feed gives until its end."""
    found: list[bytes] = []

    def ended() -> bool:
        part = feed.take()
        found.append(part or b"")
        return part is None

    eventually(ended)
    return b"".join(found)


def test_a_topic_is_subscribed_and_its_units_are_converted() -> None:
    other = imu(7, topic="/other")
    with rosbridge(imu(0), other, {"op": "status", "level": "info", "msg": "hello"}, *map(imu, range(1, 250))) as (
        address,
        heard,
    ):
        feed = RosbridgeFeed(address, "/imu/data")
        feed.open()
        found = LineDecoder().feed(lines_of(feed))
        feed.close()
        feed.close()
    assert heard == [{"op": "subscribe", "topic": "/imu/data"}]
    assert (len(found), found.damaged) == (250, 0)
    assert found.columns["t_s"][-1] == pytest.approx(2.49, abs=1e-6)
    assert found.columns["gyro_x"][0] == pytest.approx(1.0, rel=1e-12)
    assert found.columns["gyro_z"][0] == pytest.approx(-28.64788975654116, rel=1e-12)
    assert [found.columns[f"accel_{axis}_g"][0] for axis in "xyz"] == pytest.approx([0.0, 0.5, 1.0], rel=1e-12)


def test_what_is_no_message_is_counted() -> None:
    with rosbridge(imu(0), "{broken\n", imu(1)) as (address, _):
        feed = RosbridgeFeed(address, "/imu/data")
        feed.open()
        found = LineDecoder().feed(lines_of(feed))
    assert (len(found), found.damaged) == (2, 1)


def test_an_error_of_the_server_is_said() -> None:
    with rosbridge({"op": "status", "level": "error", "msg": "Unable to import sensor_msg"}) as (address, _):
        feed = RosbridgeFeed(address, "/imu")
        feed.open()
        with pytest.raises(BadInput, match=r"topic /imu of ws://.*: rosbridge says 'Unable to import sensor_msg'"):
            eventually(lambda: feed.take() is None)


def test_the_end_of_the_connection_ends_the_stream() -> None:
    with rosbridge(imu(0)) as (address, _):
        source = LineSource(RosbridgeFeed(address, "/imu/data"), LineDecoder(), INFO, VirtualClock())
        source.start()
        with pytest.raises(StreamEnded):
            eventually(lambda: source.read(0.001) is None)
        source.stop()


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("ws://", "ws://: no address of a rosbridge server; write ws://HOST:PORT"),
        ("ws://127.0.0.1:1", r"ws://127.0.0.1:1: cannot connect \(.*\); check address, and that rosbridge_server runs"),
    ],
)
def test_an_address_that_does_not_answer_is_one_clear_line(address: str, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        network_feed(address, "/imu/data").open()
