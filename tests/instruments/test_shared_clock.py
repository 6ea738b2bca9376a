"""One clock of a simulator and of the processes that drive it: alike in all, and still while one of them is late."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from instruments import shared_clock
from instruments.bench_config import BenchFile, SimulationSettings, read_bench
from instruments.clock import ScaledClock, SystemClock, VirtualClock, registered
from instruments.shared_clock import (
    DOUBTED_S,
    GIVEN_UP_S,
    HEARTBEATS,
    LATE_CLOCK_S,
    SIZE,
    THREADS,
    ClockFile,
    SharedClock,
    clock_outside,
    is_held_up,
    served_clock,
)
from instruments.simulators.server import SimulationServer
from procedures.contracts.control import Control
from procedures.execution.stoppable_clock import stoppable
from procedures.monitoring.host_stalls import HostStalls
from tests.helpers.virtual_wall import VirtualWall
from tests.helpers.waiting import eventually

SPEED = 30.0
#: What is counted of a stall: until a thread is late, and between two heartbeats before and after.
LATE_S = LATE_CLOCK_S / SPEED
HEARTBEAT_INTERVAL_S = LATE_S / HEARTBEATS
COUNTED_S = LATE_S + 2 * HEARTBEAT_INTERVAL_S


class Rig:
    """A simulator and a process that drives it, one thread of each, in real time that passes at once."""

    def __init__(self) -> None:
        self.wall, self._stack = VirtualWall(), contextlib.ExitStack()
        self.held_up = False  #: whether this computer holds up the threads that are late
        self.file = ClockFile.made(SPEED, self.wall.now_s(), lambda _: self.held_up)
        self._stack.callback(self.file.path.unlink)
        self.simulator = SharedClock(self.file, owns=True, wall=self.wall)
        self.driver = SharedClock(ClockFile(self.file.path, lambda _: self.held_up), wall=self.wall)
        # both from one thread, in which a test also reads the clocks: their places are those of other threads
        self.heartbeats = {"simulator": self.register(self.simulator), "driver": self.register(self.driver)}

    def register(self, clock: SharedClock) -> Callable[[], None]:
        place = self.file.take_place(self.wall.now_s())
        self._stack.callback(self.file.leave_place, place)

        def heartbeat() -> None:
            clock.now_s()
            self.file.heartbeat(place, self.wall.now_s())

        return heartbeat

    def run(self, duration_s: float, *, without: str = "") -> None:
        """Let real time pass while every thread gives its heartbeat, except those of one process."""
        for _ in range(round(duration_s / HEARTBEAT_INTERVAL_S)):
            self.wall.pass_s(HEARTBEAT_INTERVAL_S)
            for name, heartbeat in self.heartbeats.items():
                if name != without:
                    heartbeat()

    @property
    def both_s(self) -> tuple[float, float]:
        return self.simulator.now_s(), self.driver.now_s()

    def close(self) -> None:
        self._stack.close()


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.close()


def test_both_run_at_the_speed(rig: Rig) -> None:
    rig.run(2.0)
    assert rig.both_s == pytest.approx((SPEED * 2.0, SPEED * 2.0))


@pytest.mark.parametrize("late", ["simulator", "driver"])
def test_the_clock_of_both_stands_still_while_one_is_late(rig: Rig, late: str) -> None:
    rig.run(1.0)
    rig.run(1.3, without=late)
    held = rig.both_s
    assert held == pytest.approx((SPEED, SPEED), abs=SPEED * COUNTED_S)
    rig.run(1.0)
    now = rig.both_s
    assert now[0] == pytest.approx(now[1])
    assert now[0] - held[0] == pytest.approx(SPEED, abs=SPEED * COUNTED_S)


def test_a_computer_that_stands_still_counts_for_neither(rig: Rig) -> None:
    rig.run(1.0)
    rig.wall.pass_s(3.0)
    rig.heartbeats["driver"]()
    rig.wall.pass_s(0.01)
    rig.run(1.0)
    assert rig.both_s == pytest.approx((2 * SPEED, 2 * SPEED), abs=SPEED * (COUNTED_S + 0.01))
    assert rig.simulator.now_s() == pytest.approx(rig.driver.now_s())


def test_the_clock_never_goes_back(rig: Rig) -> None:
    seen = [0.0]
    for without in ("", "driver", "", "simulator", ""):
        for _ in range(20):
            rig.run(0.02, without=without)
            seen.append(rig.driver.now_s())
    assert seen == sorted(seen)


def test_a_sleep_lasts_through_a_stall(rig: Rig) -> None:
    name = threading.current_thread().name
    begun_s = rig.wall.now_s()
    stalls = [0.0, 0.0, 2.0]

    def halted(_: threading.Condition) -> None:
        rig.wall.pass_s(stalls.pop() if stalls else 0.0)
        for heartbeat in rig.heartbeats.values():
            heartbeat()

    rig.wall.meanwhile[name] = halted
    rig.driver.sleep(SPEED * 0.3)
    # each wait of a sleep is longer than a thread may be late, and only the rest of it counts
    assert rig.wall.now_s() - begun_s > 2.0 + 0.3 - LATE_S
    assert rig.driver.now_s() == pytest.approx(SPEED * 0.3)


def test_a_thread_that_is_halted_for_good_is_not_waited_for(rig: Rig) -> None:
    rig.run(GIVEN_UP_S + 1.0, without="driver")
    assert rig.simulator.now_s() == pytest.approx(SPEED, rel=0.05)


def test_a_thread_that_this_computer_holds_up_is_waited_for_longer(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_clock, "MAX_HELD_UP_S", longest_s := GIVEN_UP_S + 3.0)
    rig.held_up = True
    rig.run(1.0)
    rig.run(longest_s - 1.0, without="simulator")
    assert rig.both_s == pytest.approx((SPEED, SPEED), abs=SPEED * COUNTED_S)
    rig.run(2.0, without="simulator")
    assert rig.driver.now_s() == pytest.approx(2 * SPEED, rel=0.05)


def test_a_thread_that_waits_for_a_processor_is_held_up_and_one_that_sleeps_or_is_halted_is_not() -> None:
    code = "import sys; print(flush=True); sys.stdin.readline(); print(flush=True)\nwhile True: pass"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdout.readline()
            eventually(lambda: not is_held_up(process.pid))
            process.stdin.write(b"\n")
            process.stdin.flush()
            process.stdout.readline()
            eventually(lambda: is_held_up(process.pid))
            process.send_signal(signal.SIGSTOP)
            eventually(lambda: not is_held_up(process.pid))
        finally:
            process.kill()
    assert not is_held_up(process.pid)


def test_a_process_that_has_ended_is_not_waited_for(rig: Rig) -> None:
    code = (
        "import sys; from pathlib import Path; from instruments.shared_clock import ClockFile\n"
        "ClockFile(Path(sys.argv[1])).take_place(float(sys.argv[2]))"
    )
    subprocess.run([sys.executable, "-c", code, str(rig.file.path), str(rig.wall.now_s())], check=True)
    rig.run(1.0 + DOUBTED_S)
    assert rig.simulator.now_s() == pytest.approx(SPEED, rel=0.05)
    rig.run(1.0)
    assert rig.both_s == pytest.approx((2 * SPEED, 2 * SPEED), rel=0.05)


def test_places_are_given_back(rig: Rig) -> None:
    for _ in range(2 * THREADS):
        with rig.driver.registered():
            pass
    for _ in range(THREADS - rig.file.registered):
        rig.file.take_place(rig.wall.now_s())
    with pytest.raises(OSError, match=f"more than {THREADS} threads"):
        rig.file.take_place(rig.wall.now_s())


def test_a_bench_file_leads_to_the_clock_of_the_simulator() -> None:
    with served_clock(SPEED) as clock:
        server = SimulationServer(read_bench("single-axis-sim"), clock)
        try:
            far = server.start()
            found = clock_outside(far)
            assert isinstance(found, SharedClock)
            assert isinstance(clock, SharedClock)
            assert found.path == clock.path
            assert found.speed == SPEED
        finally:
            server.stop()
    assert not found.path.exists()
    assert not isinstance(clock_outside(far), SharedClock)  # its simulator has ended


def outside(simulation: SimulationSettings | None) -> BenchFile:
    return read_bench("single-axis-sim").model_copy(update={"simulation": simulation})


def test_at_speed_1_and_on_a_real_bench_it_is_the_clock_of_this_computer() -> None:
    with served_clock(1.0) as clock:
        assert isinstance(clock, SystemClock)
    assert isinstance(clock_outside(outside(None)), SystemClock)
    assert isinstance(clock_outside(outside(SimulationSettings())), SystemClock)


def test_another_file_is_none_of_a_clock(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    other = tmp_path / "other"
    other.write_text("something")
    with pytest.raises(OSError, match="has 9 bytes"):
        ClockFile(other)
    other.write_bytes(bytes(SIZE))
    with pytest.raises(OSError, match="not the file of a clock"):
        ClockFile(other)
    found = clock_outside(outside(SimulationSettings(control="127.0.0.1:1", speed=4.0, clock=str(other))))
    assert not isinstance(found, SharedClock)
    assert isinstance(found, ScaledClock)
    assert found.speed == 4.0
    assert "clock.not_shared" in caplog.text


def test_a_campaign_is_registered_and_has_no_stalls(rig: Rig) -> None:
    clock = stoppable(rig.driver, Control())
    stalls = HostStalls(clock, wall := VirtualClock())
    before = rig.file.registered

    def watch() -> int:
        with stalls.watching():
            wall.sleep(100.0)
            assert stalls.total_clock_s() == 0.0
            assert stalls.news() is None
            return rig.file.registered

    with ThreadPoolExecutor(1) as pool:  # the threads of the rig are registered already
        assert pool.submit(watch).result() == before + 1
    assert rig.file.registered == before
    with registered(VirtualClock()) as heartbeat:
        heartbeat()
