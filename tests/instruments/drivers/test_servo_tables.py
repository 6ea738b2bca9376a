"""Newport XPS and Aerotech Ensemble by their descriptions, through bytes: what is sent, states, faults and stops."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from instruments.errors import NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.table import EncoderTable
from procedures.execution.safe_state import stop_table

NAMES = ("newport-xps", "aerotech-ensemble")


class Rig:
    """A bench with one of the tables, and everything that its controller is sent."""

    def __init__(self, name: str, table: dict[str, Any] | None = None, **simulated: Any) -> None:
        record = read_bench("servo-sim").model_dump()
        record["table"] = {
            "driver": name, "host": f"sim://{name}", "max_rate_dps": 200, "acceleration_dps2": 100,
            "reference": "measured", **(table or {}),
        }  # fmt: skip
        record["simulation"]["table"] |= simulated
        self.clock = VirtualClock()
        self.file = resolve(BenchFile.model_validate(record))
        self.bench = open_bench(self.file, self.clock)
        assert self.bench.simulation is not None
        self.simulation: Any = self.bench.simulation
        self.url = f"sim://{name}"
        self.device: Any = self.simulation.device(self.url)._device
        self.table: Any = self.bench.table
        self.said: list[str] = []
        self._hear(self.device)

    def _hear(self, link: Any) -> Any:
        """Note what a link is sent, and what those are sent that are opened after it."""
        receive, connect = link.receive, getattr(link, "connect", None)

        def heard(data: bytes, t_s: float) -> None:
            self.said.append(data.decode())
            receive(data, t_s)

        link.receive = heard
        if connect is not None:
            link.connect = lambda: self._hear(connect())
        return link

    @property
    def motion(self) -> Any:
        return self.simulation.world.servo


@pytest.fixture
def rig() -> Callable[..., Rig]:
    return Rig


@pytest.mark.parametrize("name", NAMES)
def test_a_run_from_home_to_rest(name: str, rig: Callable[..., Rig]) -> None:
    s = rig(name, rate_ratio=1.0002, encoder_noise_deg=1e-4)
    assert isinstance(s.table, EncoderTable)
    assert s.table.identify()
    s.table.home()
    assert abs(s.table.angle_deg()) < 0.01
    spin = s.table.spin(-45.5, 20.0)
    assert s.table.is_moving()
    assert s.motion.rate_dps(s.clock.now_s()) == pytest.approx(-45.5 * 1.0002)
    found = []
    for _ in range(15):
        found.append(s.table.read_angle())
        s.clock.sleep(1.1)
    t_s, angle = np.array([one.t_s for one in found]), np.array([one.angle_deg for one in found])
    assert np.polyfit(t_s, angle, 1)[0] == pytest.approx(-45.5 * 1.0002, abs=1e-3)
    s.table.settle(spin)
    assert not s.table.is_moving()
    again = s.table.spin(10.0, 1.0)
    assert again.rate_dps == 10.0
    s.table.stop()
    s.clock.sleep(3.0)
    assert s.motion.rate_dps(s.clock.now_s()) == 0


def test_the_bytes_of_an_xps(rig: Callable[..., Rig]) -> None:
    """Requests without a line end, as the clients of the XPS send them; a reply ends with EndOfAPI."""
    s = rig("newport-xps", {"parameters": {"group": "ROT"}})
    s.table.home()
    home = ["GroupKill(ROT)", "GroupInitialize(ROT)", "GroupHomeSearch(ROT)"]
    assert [each for each in s.said if each in home][-3:] == home
    s.said.clear()
    s.table.spin(12.5, 1.0)
    run = [each for each in s.said if "Jog" in each]
    assert run == ["GroupJogModeEnable(ROT)", "GroupJogParametersSet(ROT,12.500000,100.0000)"]
    s.said.clear()
    s.table.stop()
    assert s.said[0] == "GroupMoveAbort(ROT)"  # once: two without a line end between them would be one request
    s.device.receive(b"GroupStatusGet(ROT,int *)", s.clock.now_s())
    s.clock.sleep(0.1)
    assert s.device.transmit(s.clock.now_s()).endswith(b"0,10,EndOfAPI")  # ready, after an abort


def test_the_bytes_of_an_ensemble(rig: Callable[..., Rig]) -> None:
    s = rig("aerotech-ensemble", {"parameters": {"axis": 2}})
    s.table.home()
    assert s.said[:5] == [
        "WAIT MODE NOWAIT\n", "RAMP MODE @2 RATE\n", "RAMP RATE @2 100.000000\n", "SETPARM @2, 73, 100.000000\n",
        "ENABLE @2\n",
    ]  # fmt: skip
    assert "HOME @2\n" in s.said
    s.table.spin(-12.5, 1.0)
    assert "FREERUN @2 -12.500000\n" in s.said
    s.said.clear()
    s.table.stop()
    assert s.said[0] == "ABORT @2\nABORT @2\n"
    for request, reply in (("NONE", b"!\n"), ("GETPARM(@2, 140)", b"%TABLE\n"), ("GETPARM(@1, 140)", b"!\n")):
        s.clock.sleep(1.0)
        s.device.transmit(s.clock.now_s())
        s.device.receive(f"{request}\n".encode(), s.clock.now_s())
        s.clock.sleep(0.1)
        assert s.device.transmit(s.clock.now_s()) == reply


@pytest.mark.parametrize("name", NAMES)
def test_a_new_process_stops_a_table_that_turns_before_it_asks_anything(name: str, rig: Callable[..., Rig]) -> None:
    s = rig(name)
    s.table.home()
    s.table.spin(90.0, 60.0)
    s.table.close()
    s.said.clear()
    begun_s = s.clock.now_s()
    s.simulation.faults(s.url).arm("lost_reply")
    s.table.stop()
    assert s.said[0].startswith(("GroupMoveAbort", "ABORT"))
    assert len(s.said) == 1
    assert s.clock.now_s() - begun_s < 0.1
    s.clock.sleep(2.0)
    assert s.motion.rate_dps(s.clock.now_s()) == 0


@pytest.mark.parametrize(("name", "why"), [("newport-xps", "error -22, not allowed"), ("aerotech-ensemble", "a fault")])
def test_an_axis_that_gave_up_is_no_run(name: str, why: str, rig: Callable[..., Rig]) -> None:
    s = rig(name)
    s.table.home()
    spin = s.table.spin(30.0, 10.0)
    s.simulation.faults(s.url).arm("stall")
    s.table.is_moving()  # the fault is as of the next request
    s.clock.sleep(2.0)
    assert not s.table.is_moving()
    with pytest.raises(RequestRejected, match="stopped by itself during a run at 30 deg/s"):
        s.table.settle(spin)
    with pytest.raises(RequestRejected, match=why):
        s.table.spin(30.0, 10.0)


def test_a_command_that_takes_long_is_awaited_and_one_that_never_ends_is_said(rig: Callable[..., Rig]) -> None:
    slow = rig("newport-xps", home_s=60.0)
    slow.table.home()
    assert slow.clock.now_s() > 60.0
    endless = rig("newport-xps", home_s=500.0)
    with pytest.raises(NoReply, match="GroupHomeSearch"):
        endless.table.home()


class Ended(Exception):
    """What a stop raises in the thread that drives the bench."""


class EndingClock:
    """The clock of a bench that is stopped after a while."""

    def __init__(self, clock: VirtualClock, at_s: float) -> None:
        self._clock, self._at_s = clock, at_s

    def now_s(self) -> float:
        return self._clock.now_s()

    def sleep(self, duration_s: float) -> None:
        self._clock.sleep(duration_s)
        if self._clock.now_s() > self._at_s:
            raise Ended


@pytest.mark.parametrize(
    ("name", "stop"), [("newport-xps", "GroupKill(GROUP1)"), ("aerotech-ensemble", "ABORT @0\n" * 2)]
)
def test_a_stop_ends_a_home_search_at_once(name: str, stop: str, rig: Callable[..., Rig]) -> None:
    s = rig(name, home_s=60.0)
    s.table.identify()
    link = s.table.dialogue.link
    at_s = s.clock.now_s() + 20.0
    link._clock = EndingClock(s.clock, at_s)
    with pytest.raises(Ended):
        s.table.home()
    assert s.clock.now_s() - at_s <= 1.0  # a second of waiting for bytes
    link._clock = s.clock
    s.said.clear()
    s.table.stop()
    assert s.said == [stop]
    assert s.clock.now_s() - at_s < 1.1
    s.clock.sleep(1.0)
    assert not s.motion.moving(s.clock.now_s())


def test_a_stop_ends_a_home_search_that_another_process_has_begun(rig: Callable[..., Rig]) -> None:
    """The other process waits for its answer, which is an error then; a move abort alone is refused in a search."""
    s = rig("newport-xps", home_s=60.0)
    other: Any = open_bench(s.file, s.clock, s.simulation).table
    s.motion.move_to(0.0, 170.0, 100.0, 100.0)  # far from its home
    s.clock.sleep(10.0)
    begun_s = s.clock.now_s()
    link = other.dialogue.link
    link._clock = EndingClock(s.clock, begun_s + 5.0)
    with pytest.raises(Ended):
        other.home()
    assert s.motion.moving(s.clock.now_s())
    s.said.clear()
    asked_s = s.clock.now_s()
    assert stop_table(s.table, s.clock) is None
    assert s.said[:3] == ["GroupMoveAbort(GROUP1)", "GroupStatusGet(GROUP1,int *)", "GroupKill(GROUP1)"]
    assert not s.motion.moving(s.clock.now_s())
    assert s.clock.now_s() - asked_s < 5.0
    link._clock = s.clock
    assert link._port.read(20) == b"-27,,EndOfAPI"
    s.table.home()
    assert abs(s.table.angle_deg()) < 0.01


def test_a_stop_without_a_home_search_keeps_the_power_on(rig: Callable[..., Rig]) -> None:
    s = rig("newport-xps")
    s.table.home()
    s.said.clear()
    s.table.stop()
    s.table.spin(30.0, 5.0)
    s.table.stop()
    assert not [each for each in s.said if "Kill" in each]
    assert s.said[-1] == "GroupMoveAbort(GROUP1)"  # its own run: nothing is asked


def test_a_controller_that_does_not_say_whether_it_homes_is_stopped_in_both_ways(rig: Callable[..., Rig]) -> None:
    s = rig("newport-xps")
    s.table.home()
    s.simulation.faults(s.url).arm("silence", from_s=s.clock.now_s())
    s.said.clear()
    s.table.stop()
    assert (s.said[0], s.said[-1]) == ("GroupMoveAbort(GROUP1)", "GroupKill(GROUP1)")


def test_another_instrument_is_refused(rig: Callable[..., Rig]) -> None:
    s = rig("aerotech-ensemble")
    s.device.number = "7"
    s.device._commands = s.device._compiled()
    with pytest.raises(WrongInstrument, match="does not fit the pattern"):
        s.table.identify()


@pytest.mark.parametrize("name", NAMES)
def test_a_controller_with_another_serial_number_is_refused(name: str, rig: Callable[..., Rig]) -> None:
    said = rig(name).table.identify()
    word = said.split()[-1]
    assert rig(name, {"serial": word}).table.identify() == said
    with pytest.raises(WrongInstrument, match=r"but the bench file gives serial number .*; correct the address"):
        rig(name, {"serial": f"{word}9"}).table.identify()
    with pytest.raises(WrongInstrument, match="leave serial out where the instrument does not report it"):
        rig(name, {"serial": f"9{word}"}).table.identify()


def test_a_group_or_an_axis_that_is_not_there_is_named(rig: Callable[..., Rig]) -> None:
    s = rig("newport-xps")
    s.device.controller.group = "OTHER"
    with pytest.raises(RequestRejected, match="error -19, no group of this name"):
        s.table.home()
