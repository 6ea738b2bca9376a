"""A foreign node on python-can's virtual bus: cantools encodes what it sends, the driver reads the bus."""

from __future__ import annotations

import errno
import uuid
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import can
import cantools
import numpy as np
import pytest

from instruments.clock import SystemClock, VirtualClock
from instruments.drivers.can_bus import TRIAL, CanGyro
from instruments.errors import LinkError
from instruments.protocols.can.settings import CanSettings
from instruments.transport.can_port import CanPort, open_can, remedy
from instruments.transport.factory import Ports
from instruments.transport.stream_reader import PolledReader

RATE_HZ = 100.0


class Node:
    """A unit of other hands, which sends a cycle each 10 ms of the clock, at the latest when its bus is read."""

    def __init__(self, channel: str, clock: VirtualClock) -> None:
        self._bus, self._clock, self._sent = can.Bus(channel, interface="virtual"), clock, 0
        self._database = cantools.database.load_string(str(TRIAL["dbc"]), "dbc")
        self.heard = self._bus.recv

    def close(self) -> None:
        self._bus.shutdown()

    def send_due(self) -> None:
        while self._sent < int(self._clock.now_s() * RATE_HZ + 1e-9):
            self._sent += 1
            self.cycle(self._sent)

    def cycle(self, n: int) -> None:
        if n % 20 == 1:
            self.message("Housekeeping", Temperature=31.25)
        self.message("Rates", RateX=n % 50, RateY=-(n % 50), Count=n % 16, State="Valid")
        self._bus.send(can.Message(arbitration_id=0x55, is_extended_id=False, data=b"other"))
        self.message("RateAndForce", RateZ=2 * (n % 50), ForceZ=-9.80665)

    def message(self, name: str, **values: Any) -> None:
        found = self._database.get_message_by_name(name)
        self._bus.send(
            can.Message(
                arbitration_id=found.frame_id, is_extended_id=found.is_extended_frame, data=found.encode(values)
            )
        )


class Polled:
    """A bus to which the node has sent what is due whenever it is asked."""

    def __init__(self, port: CanPort, node: Node) -> None:
        self._port, self._node = port, node

    @property
    def in_waiting(self) -> int:
        self._node.send_due()
        return self._port.in_waiting

    def reset_input_buffer(self) -> None:
        self._node.send_due()
        self._port.reset_input_buffer()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._port, name)


@pytest.fixture
def place() -> Iterator[SimpleNamespace]:
    channel, clock = uuid.uuid4().hex, VirtualClock()
    node = Node(channel, clock)
    yield SimpleNamespace(url=f"can://virtual/{channel}?bitrate=500000#imu", clock=clock, node=node)
    node.close()


def gyro(place: Any, ports: Any, **changes: Any) -> CanGyro:
    given = {
        "driver": "can",
        "name": "imu",
        "serial": "C-1",
        "max_rate_dps": 300,
        **TRIAL,
        "port": place.url,
        **changes,
    }
    return CanGyro(CanSettings.model_validate(given), ports, place.clock)


def test_a_foreign_nodes_messages_become_its_values(place: Any) -> None:
    clock, node = place.clock, place.node
    ports = SimpleNamespace(
        serial=lambda url, timeout_s, **_: Polled(open_can(url, timeout_s=timeout_s), node),
        stream_reader=lambda _, port: PolledReader(port, clock),
    )
    driver = gyro(place, ports, start=["000#0100"])
    assert driver.identify().serial == "C-1"
    driver.start()
    started = [node.heard(0), node.heard(0)]
    assert [(each.arbitration_id, bytes(each.data)) for each in started if each] == [(0, b"\x01\x00")] * 2
    parts = [driver.read(0.5) for _ in range(6)]
    channels = {each.name: each for each in driver.channels}
    values = {
        name: channel.value(np.concatenate([each.raw[name] for each in parts])) for name, channel in channels.items()
    }
    n = np.round(values["gyro_x"]).astype(int)
    assert len(n) == 300
    assert (np.diff(n) % 50 == 1).all()
    assert values["gyro_x"] == pytest.approx(n)
    assert values["gyro_y"] == pytest.approx(-n)
    assert values["gyro_z"] == pytest.approx(2 * n)
    assert values["accel_z_g"] == pytest.approx(-1.0, rel=1e-6)
    assert values["temperature_c"] == pytest.approx(31.25)
    assert sum(each.lost + each.damaged for each in parts) == 0
    assert np.allclose(np.diff(np.concatenate([each.t_s for each in parts])), 0.01, rtol=1e-3)
    driver.stop()


def test_the_bus_is_opened_by_its_address(place: Any) -> None:
    """Through the ports of a bench; the thread that empties a real port takes what the node has sent."""
    ports = Ports(SystemClock())
    port = ports.serial(place.url, device="imu", baudrate=0, timeout_s=1.0)
    assert isinstance(port, CanPort)
    place.node.cycle(1)
    assert len(port.read(16 * 4)) == 64
    place.node.cycle(1)
    reader = ports.stream_reader(place.url, port)
    assert len(reader.take().data) == 64
    reader.close()
    port.close()
    port.close()
    with pytest.raises(OSError, match="the CAN bus is closed"):
        port.write(bytes(16))


@pytest.mark.parametrize(
    ("address", "text"),
    [
        (
            "can://virtuel/x",
            r"port can://virtuel/x cannot be opened \(NotImplementedError: .*\); check interf",
        ),
        (
            "can://slcan//dev/none?bitrate=250000",
            r"port can://slcan//dev/none.* cannot be opened \(.*; check interface",
        ),
        ("can://nothing", r"is no address of a CAN bus; .*; check the address"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_one_line(address: str, text: str) -> None:
    with pytest.raises(LinkError, match=text) as caught:
        Ports(SystemClock()).serial(address, device="imu", baudrate=0, timeout_s=0.1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("number", [errno.ENODEV, errno.ENETDOWN])
def test_an_interface_of_the_kernel_that_is_down_is_told_how_to_set_up(number: int) -> None:
    text = remedy("can://socketcan/can3?bitrate=250000", OSError(number, "down"))
    assert "`sudo ip link set can3 up type can bitrate 250000 restart-ms 100`" in text
    assert "modprobe can_raw" in remedy("can://socketcan/can3", OSError(errno.EAFNOSUPPORT, "no CAN"))


def test_an_interface_that_fails_is_a_lost_link(place: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    driver = gyro(place, Ports(SystemClock()))
    driver._stream.open()

    def fail(*_: Any) -> None:
        raise can.CanOperationError("the adapter was unplugged")

    port: Any = driver._stream._port
    driver._stream._reader.close()  # type: ignore[union-attr]
    driver._stream._reader = PolledReader(port, place.clock)
    monkeypatch.setattr(port._bus, "recv", fail)
    with pytest.raises(LinkError, match=r"imu: the link can://virtual/.* broke \(the adapter was unplugged\); check"):
        driver._stream.read_available()


def test_a_bus_off_that_only_the_interface_states_is_an_error_frame(
    place: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = open_can(place.url, timeout_s=0.0)
    monkeypatch.setattr(type(port._bus), "state", can.BusState.ERROR)
    assert port.in_waiting == 16
    assert port.read(16)[:4] == (0x20000040).to_bytes(4, "little")
    port.close()
