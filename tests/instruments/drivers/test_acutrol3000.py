"""The ACUTROL 3000 through bytes: rates, angles, interlocks, limits, errors, a stop that waits for nothing, home."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import ScaledClock, VirtualClock
from instruments.drivers.resolution import resolve
from instruments.errors import LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.table import EncoderTable, OpenLoopTable

Make = Callable[..., Any]
URL = "sim://acutrol-3000"


def messages(stand: Any) -> list[str]:
    """Take down what the controller is sent, from now on."""
    said: list[str] = []
    device = stand.bench.simulation.device(URL)
    receive = device.receive

    def heard(data: bytes, t_s: float) -> None:
        said.append(data.decode().strip())
        receive(data, t_s)

    device.receive = heard
    return said


def controller(stand: Any) -> Any:
    return stand.bench.simulation.device(URL)._device


@pytest.mark.parametrize("plain_lines", [False, True])
def test_a_run_from_interlock_to_rest(stand: Make, plain_lines: bool) -> None:
    s = stand("servo-sim", simulation={"table": {"plain_lines": plain_lines, "reply_s": 0.002}})
    said, table = messages(s), s.bench.table
    assert "Acutrol3000" in table.identify()
    table.home()
    assert "Interlock:Close 1" in "".join(said)
    assert table.angle_deg() == pytest.approx(0.0, abs=0.01)
    spin = table.spin(-45.5, 10.0)
    assert ":Demand:Rate 1,-45.50000;:Mode:Rate 1" in said
    assert (spin.asked_dps, spin.rate_dps) == (-45.5, -45.5)
    assert table.is_moving()
    s.clock.sleep(9.0)
    assert s.world.motion.rate_dps(s.clock.now_s()) == -45.5
    table.settle(spin)
    assert not table.is_moving()
    assert not s.world.table_turns(s.clock.now_s())
    assert said.count(":Interlock:Close 1") == 1  # once for each opening of the link


def test_the_encoder_gives_time_and_angle_unwrapped(stand: Make) -> None:
    s = stand("servo-sim", simulation={"table": {"rate_ratio": 1.0002, "reply_s": 0.004}})
    table = s.bench.table
    assert isinstance(table, EncoderTable)
    assert not isinstance(table, OpenLoopTable)
    spin = table.spin(150.0, 30.0)
    found = []
    for _ in range(20):
        found.append(table.read_angle())
        s.clock.sleep(1.7)  # two thirds of a turn
    t_s, angle = np.array([one.t_s for one in found]), np.array([one.angle_deg for one in found])
    assert np.polyfit(t_s, angle, 1)[0] == pytest.approx(150.03, abs=1e-4)
    # the time is the middle between question and answer; the angle is as of the question
    assert s.world.motion.angle_deg(t_s - 0.002) - angle == pytest.approx(
        np.full(20, (s.world.motion.angle_deg(t_s[:1] - 0.002) - angle[0]).item()), abs=2e-5
    )
    assert all(one.u_s >= 5e-4 for one in found)
    table.settle(spin)


def test_a_stop_is_sent_before_anything_else_and_waits_for_no_other_reply(stand: Make) -> None:
    s = stand("servo-sim")
    s.bench.table.spin(90.0, 60.0)
    begun_s = s.clock.now_s()
    said = messages(s)
    s.faults(URL).arm("lost_reply")  # no reply ever comes again
    s.bench.table.stop()
    assert said == [":Mode:Off 1"]
    assert s.clock.now_s() - begun_s < 0.5
    s.clock.sleep(1.0)
    assert not s.world.table_turns(s.clock.now_s())
    s.bench.table.stop()  # also twice


def test_a_new_process_stops_a_table_that_turns(stand: Make) -> None:
    s = stand("servo-sim")
    s.bench.table.spin(90.0, 60.0)
    s.bench.table.close()
    other = open_bench(s.file, s.clock, s.bench.simulation)
    assert other.table is not None
    said = messages(s)
    other.table.stop()
    assert said == [":Mode:Off 1"]
    s.clock.sleep(1.0)
    assert not other.table.is_moving()
    other.close()


def test_an_interlock_at_fault_is_named_and_not_reset(stand: Make) -> None:
    s = stand("servo-sim")
    controller(s).trip(0.0, hardware=1 << 9)
    with pytest.raises(RequestRejected, match=r"interlock is at fault \(master interlock\); remove the cause"):
        s.bench.table.home()
    with pytest.raises(RequestRejected, match="at fault"):
        s.bench.table.spin(10.0, 1.0)
    assert not s.world.table_turns(s.clock.now_s())
    allowed = stand("servo-sim", table={"reset_interlocks": True})
    controller(allowed).trip(0.0, software=1 << 1)
    allowed.bench.table.home()


def test_a_run_that_an_interlock_ends_says_which(stand: Make) -> None:
    s = stand("servo-sim")
    spin = s.bench.table.spin(90.0, 60.0)
    controller(s).trip(s.clock.now_s(), software=1 << 2)
    s.clock.sleep(3.0)
    with pytest.raises(RequestRejected, match=r"during a run at 90 deg/s.*at fault \(position tracking error\)"):
        s.bench.table.is_moving()
    with pytest.raises(RequestRejected, match="position tracking error"):
        s.bench.table.settle(spin)


def test_limits_beyond_the_controllers_own_are_refused(stand: Make) -> None:
    s = stand("servo-sim", simulation={"table": {"absolute_dps": 150.0}})
    with pytest.raises(WrongInstrument, match=r"max_rate_dps = 200, but the absolute limit .* is 150; lower the value"):
        s.bench.table.identify()


def test_a_refused_command_and_its_error_are_reported(stand: Make) -> None:
    s = stand("servo-sim")
    s.bench.table.home()
    s.faults(URL).arm("refusal", count=1)
    with pytest.raises(RequestRejected, match="rejected ':Mode:Off 1' with error 101 'Parameter Out Of Range'"):
        s.bench.table.spin(0.0, 1.0)


def test_a_late_reply_is_not_taken_for_the_next_answer(stand: Make) -> None:
    s = stand("servo-sim")
    table = s.bench.table
    table.home()
    device = controller(s)
    device._reply_s = 1.25
    with pytest.raises(NoReply):
        table.angle_deg()
    device._reply_s = 0.002
    assert "Acutrol3000" in table.identify()


def test_another_instrument_and_no_numbers_are_reported(stand: Make) -> None:
    s = stand("servo-sim")
    handlers = controller(s)._handlers
    handlers["*idn?"] = lambda *_: "KEITHLEY INSTRUMENTS INC.,MODEL 2000"
    with pytest.raises(WrongInstrument, match="not the answer of an ACUTROL 3000"):
        s.bench.table.identify()
    handlers["read:position?"] = lambda *_: "OK"
    with pytest.raises(MalformedReply, match="1 numbers were expected"):
        s.bench.table.angle_deg()


def test_a_direction_turns_rate_and_angle_round(stand: Make) -> None:
    s = stand("servo-sim", table={"direction": -1})
    spin = s.bench.table.spin(30.0, 10.0)
    first = s.bench.table.read_angle()
    s.clock.sleep(2.0)
    assert s.bench.table.read_angle().angle_deg - first.angle_deg == pytest.approx(60.0, abs=0.5)
    assert s.world.motion.rate_dps(s.clock.now_s()) == 30.0
    s.bench.table.settle(spin)


def test_host_or_port_but_not_both() -> None:
    record = read_bench("servo-sim").model_dump()
    for wrong in ({"host": None}, {"port": "/dev/ttyUSB0"}):
        with pytest.raises(ValueError, match="give either host"):
            resolve(BenchFile.model_validate({**record, "table": {**record["table"], **wrong}}))


@pytest.fixture
def served() -> Iterator[tuple[str, int]]:
    """A real TCP server of the simulated controller, on a clock that stands still but for its replies."""
    record = read_bench("servo-sim").model_dump()
    clock = VirtualClock()
    simulation = open_bench(BenchFile.model_validate(record), clock).simulation
    assert simulation is not None
    device = simulation.device(URL)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            link, _ = server.accept()
            with link:
                while data := link.recv(4096):
                    device.receive(data, clock.now_s())
                    clock.sleep(1.0)
                    link.sendall(device.transmit(clock.now_s()))

        thread = threading.Thread(target=serve)
        thread.start()
        yield server.getsockname()
        thread.join(10)


def test_the_driver_speaks_over_a_real_socket(served: tuple[str, int]) -> None:
    record = read_bench("servo-sim").model_dump()
    record["table"] |= {"host": served[0], "tcp_port": served[1]}
    bench = open_bench(BenchFile.model_validate(record), ScaledClock(1.0))
    assert bench.table is not None
    try:
        assert "Acutrol3000" in bench.table.identify()
        assert not bench.table.is_moving()
        assert (bench.table.angle_deg() + 180.0) % 360.0 == pytest.approx(180.0, abs=0.01)
    finally:
        bench.close()


def test_a_host_that_is_not_there_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    record = read_bench("servo-sim").model_dump()
    record["table"] |= {"host": "127.0.0.1", "tcp_port": port}
    bench = open_bench(BenchFile.model_validate(record), ScaledClock(1.0))
    assert bench.table is not None
    with pytest.raises(LinkError, match="cannot be opened"):
        bench.table.identify()
    bench.close()
