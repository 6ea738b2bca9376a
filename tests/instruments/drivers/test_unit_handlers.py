"""Unit handlers: a person, the simulator in this process, the simulator in another one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from instruments.drivers.unit_handlers import ManualUnitHandler, RemoteUnitHandler
from instruments.errors import LinkError, RequestRejected
from instruments.simulators.links.real_ports import LOCALHOST, RealPorts


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


def test_the_simulated_handler_reaches_the_world_of_its_bench(stand: Any) -> None:
    made = stand("triaxial-sim")
    made.bench.unit_handler.mount("-y")
    made.bench.unit_handler.power(True)
    assert made.world.position == "-y"
    assert made.world.powered_on_s == made.clock.now_s()
    made.bench.unit_handler.power(False)
    assert made.world.powered_on_s is None


def test_the_remote_handler_sends_one_line_per_request(ports: RealPorts) -> None:
    lines: list[str] = []

    def answer(line: str) -> str:
        lines.append(line)
        return "ok" if "q" not in line else "unknown position"

    handler = RemoteUnitHandler(f"{LOCALHOST}:{ports.open_line_server(answer)}")
    handler.mount("-x")
    handler.power(True)
    handler.power(False)
    with pytest.raises(RequestRejected, match="answered 'unknown position' to 'mount q'"):
        handler.mount("q")
    assert lines == ["mount -x\n", "power on\n", "power off\n", "mount q\n"]


def test_a_simulator_that_is_gone_is_a_link_error(ports: RealPorts) -> None:
    port = ports.open_line_server(lambda _: "ok")
    ports.close()
    with pytest.raises(LinkError, match="does not answer"):
        RemoteUnitHandler(f"{LOCALHOST}:{port}").mount("x")
