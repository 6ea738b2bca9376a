"""Unit handlers: a person, the simulator in this process, the simulator in another one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.unit_handlers import ManualUnitHandler, RemoteUnitHandler
from instruments.errors import LinkError, RequestRejected
from instruments.protocols.simulator_control import turn_line
from instruments.simulators.links.real_ports import LOCALHOST, RealPorts
from instruments.simulators.server import SimulationServer


@pytest.fixture
def ports() -> Iterator[RealPorts]:
    made = RealPorts()
    yield made
    made.close()


def test_a_bench_without_a_handler_asks_for_a_person() -> None:
    with pytest.raises(RequestRejected, match="only a person can turn the units to -x up"):
        ManualUnitHandler().mount("-x")
    with pytest.raises(RequestRejected, match="only a person can switch the units off"):
        ManualUnitHandler().power(False)
    with pytest.raises(RequestRejected, match="only a person can turn the units by -720 deg about z"):
        ManualUnitHandler().turn("z", -720.0)
    assert not ManualUnitHandler().is_turning()


def test_the_simulated_handler_reaches_the_world_of_its_bench(stand: Any) -> None:
    made = stand("triaxial-sim")
    made.bench.unit_handler.mount("-y")
    made.bench.unit_handler.power(True)
    assert str(made.world.position) == "-y"
    assert made.world.powered_on_s == made.clock.now_s()
    made.bench.unit_handler.power(False)
    assert made.world.powered_on_s is None


def test_the_hand_of_the_world_turns_for_a_while(stand: Any) -> None:
    made = stand("by-hand-sim")
    made.bench.unit_handler.turn("y", 360.0)
    assert (str(made.world.position), made.bench.unit_handler.is_turning()) == ("y", True)
    made.clock.sleep(20.0)
    assert not made.bench.unit_handler.is_turning()
    assert made.world.motion.angle_deg(np.array([made.clock.now_s()]))[0] == pytest.approx(360.0, abs=3.0)


def test_a_simulator_in_another_process_turns_on_request(stand: Any) -> None:
    file = stand("by-hand-sim").file
    server = SimulationServer(file, VirtualClock())
    replies = [server._control(line) for line in ("is_turning", turn_line("-z", -720.5), "is_turning", "dance")]
    assert replies == ["ok", "ok", "busy", "unknown order 'dance'"]
    assert str(server._simulated.world.position) == "-z"


def test_the_remote_handler_sends_one_line_per_request(ports: RealPorts) -> None:
    lines: list[str] = []

    def answer(line: str) -> str:
        lines.append(line)
        return "busy" if "is_turning" in line else "ok" if "q" not in line else "unknown position"

    handler = RemoteUnitHandler(f"{LOCALHOST}:{ports.open_line_server(answer)}")
    handler.mount("-x")
    handler.power(True)
    handler.power(False)
    with pytest.raises(RequestRejected, match="answered 'unknown position' to 'mount q'"):
        handler.mount("q")
    handler.turn("x", 360.0)
    assert handler.is_turning()
    assert lines == [
        "mount -x\n", "power on\n", "power off\n", "mount q\n", "turn x 360.0\n", "is_turning\n",
    ]  # fmt: skip


def test_a_simulator_that_is_gone_is_a_link_error(ports: RealPorts) -> None:
    port = ports.open_line_server(lambda _: "ok")
    ports.close()
    with pytest.raises(LinkError, match="does not answer"):
        RemoteUnitHandler(f"{LOCALHOST}:{port}").mount("x")
