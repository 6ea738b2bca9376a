"""A computer that was busy: its stalls are measured and said, and no silence of an instrument is made of them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from instruments.clock import PacedClock, ScaledClock, VirtualClock
from instruments.errors import NoReply
from instruments.interfaces.gyro import Readings
from procedures.contracts.campaign_state import CampaignState
from procedures.execution.acquire import STALLED_ATTEMPTS
from procedures.monitoring.host_stalls import PERIOD_S, SHORT_PERIOD_S, HostStalls, Lateness
from tests.helpers.engine_rig import Rig

SPEED = 30.0


class Real(VirtualClock):
    """Virtual time that says, as a real clock does, that a longer time-out takes longer."""

    def wall_s(self, duration_s: float) -> float:
        return duration_s / SPEED


def stalls_of(wall: VirtualClock) -> HostStalls:
    stalls = HostStalls(ScaledClock(SPEED), wall)
    stalls._looked_s = wall.now_s()  # as `watching` does, without its thread
    return stalls


def stall(stalls: HostStalls, wall: VirtualClock, stalled_s: float) -> None:
    wall.sleep(PERIOD_S + stalled_s)
    stalls.total_s()


@pytest.mark.parametrize("clock", [VirtualClock(), PacedClock()])
def test_a_clock_that_stands_still_meanwhile_has_no_stalls(clock: Any) -> None:
    stalls = HostStalls(clock, wall := VirtualClock())
    with stalls.watching():
        wall.sleep(100.0)
        assert (stalls.total_s(), stalls.news()) == (0.0, None)


def test_a_stall_is_measured_and_said_once() -> None:
    stalls = stalls_of(wall := VirtualClock())
    for _ in range(50):
        stall(stalls, wall, 0.02)
    assert (stalls.total_s(), stalls.news()) == (0.0, None)
    stall(stalls, wall, 1.3)
    event = stalls.news()
    assert event is not None
    assert event.message.startswith("this computer did not run labctl for 1.3 s (39 s of the bench's time); ")
    assert (event.kind, event.level, event.value) == ("host_stalled", "warning", pytest.approx(1.3))
    assert stalls.news() is None
    assert stalls.total_clock_s() == pytest.approx(39.0)


def test_many_stalls_are_said_together_and_not_at_once() -> None:
    stalls = stalls_of(wall := VirtualClock())
    stall(stalls, wall, 1.3)
    assert stalls.news() is not None
    for _ in range(4):
        stall(stalls, wall, 0.6)
        assert stalls.news() is None
    for _ in range(600):
        stall(stalls, wall, 0.0)
    event = stalls.news()
    assert event is not None
    assert event.message.startswith("this computer did not run labctl for 0.6 s at a time, 2.4 s in all (72 s of")


def test_at_the_end_of_a_campaign_nothing_remains_unsaid() -> None:
    stalls = stalls_of(wall := VirtualClock())
    stall(stalls, wall, 1.3)
    assert stalls.news() is not None
    stall(stalls, wall, 5.0)
    assert stalls.news() is None
    event = stalls.news(at_the_end=True)
    assert event is not None
    assert event.value == pytest.approx(5.0)
    assert stalls.news(at_the_end=True) is None


def test_the_last_stall_of_a_campaign_is_recorded_and_counted() -> None:
    rig = Busy()
    rig.when_step("safe_state", lambda: (rig.stall(1.3), rig.engine._context.monitor.tell_stalls(), rig.stall(5.0)))
    assert rig.run().state is CampaignState.DONE
    said = [event.value for event in rig.journal.events if event.kind == "host_stalled"]
    assert said == pytest.approx([1.3, 5.0], abs=0.2)
    assert rig.engine.progress.stalled_s == pytest.approx(6.3, abs=0.3)


class Busy(Rig):
    """The fake bench in time of which a second is 1/SPEED of a second of this computer; `stall` keeps both waiting."""

    def __init__(self) -> None:
        super().__init__()
        self.wall = VirtualClock()
        real = Real()
        real.sleep(self.clock.now_s())
        self.clock = real
        for device in (self.table, self.chamber, *self.gyros.values()):
            device.clock = real
        sleep = real.sleep

        def both(duration_s: float) -> None:
            sleep(duration_s)
            for _ in range(int(max(duration_s, 0.0) / SPEED / PERIOD_S) + 1):  # as the thread looks
                self.wall.sleep(min(max(duration_s, 0.0) / SPEED, PERIOD_S))
                self.stalls.total_s()

        real.sleep = both  # type: ignore[method-assign]
        self.slept = sleep

    @property
    def stalls(self) -> HostStalls:
        return self.engine._context.monitor.stalls

    def make(self, *given: Any, **options: Any) -> Any:
        engine = super().make(*given, **options)
        engine._context.monitor.stalls._wall = self.wall
        engine._context.monitor.stalls._run = lambda ended: None
        return engine

    def stall(self, real_s: float) -> None:
        """Let this computer do something else."""
        self.slept(real_s * SPEED)
        self.wall.sleep(real_s)


def test_a_busy_computer_is_not_a_chamber_that_does_not_answer() -> None:
    rig = Busy()
    rig.when_step("soak", lambda: rig.stall(1.3))  # 39 s of the bench, limit 30
    outcome = rig.run()
    assert outcome.state is CampaignState.DONE
    assert "guard.stale" not in rig.journal.kinds()
    (event,) = [each for each in rig.journal.events if each.kind == "host_stalled"]
    assert event.message.startswith("this computer did not run labctl for 1.")
    assert not any("cable" in each.message for each in rig.journal.events)
    assert rig.engine.progress.stalled_s == pytest.approx(1.3, abs=0.2)


def test_a_chamber_that_is_silent_beside_it_is_still_found() -> None:
    rig = Busy()
    rig.when_step("soak", lambda: rig.chamber.fail("read", NoReply("chamber", "no answer")))
    outcome = rig.run()
    assert outcome.state is CampaignState.FAILED
    assert "guard.stale" in rig.journal.kinds()


def test_a_data_set_that_a_stall_spoilt_is_taken_again_and_no_cable_is_blamed() -> None:
    rig = Busy()
    failed = [0]

    def late() -> None:
        if rig.engine._context.monitor.is_taking_readings and failed[0] < STALLED_ATTEMPTS:
            failed[0] += 1
            rig.stall(1.3)
            raise NoReply("imu", "no intact datagram for 39.0 s: no bytes arrived; check power and cable")

    rig.imu.faults["read"] = late
    assert rig.run().state is CampaignState.DONE
    repeated = [each.message for each in rig.journal.events if each.kind == "data_set_repeated"]
    assert len(repeated) == STALLED_ATTEMPTS
    assert repeated[0].startswith("data set 1 is taken again: this computer did not run labctl for 1.")
    assert not any("cable" in each.message for each in rig.journal.events)
    assert rig.engine.progress.repeated == STALLED_ATTEMPTS


def repeated(rig: Busy) -> list[str]:
    return [each.message for each in rig.journal.events if each.kind == "data_set_repeated"]


def test_a_unit_that_is_silent_beyond_a_short_stall_is_named_for_it() -> None:
    rig = Busy()

    def silent() -> None:
        if rig.engine._context.monitor.is_taking_readings:
            rig.stall(0.2)  # 6 s of the bench, in which no reading was asked for
            rig.slept(8.0)
            raise NoReply("imu", "no intact datagram for 14.0 s: no bytes arrived; check power and cable")

    rig.imu.faults["read"] = silent
    assert rig.run().state is CampaignState.FAILED
    said = "data set 1 is taken again: imu: no intact datagram for 14.0 s: no bytes arrived; check power and cable"
    assert set(repeated(rig)) == {said}


@pytest.mark.parametrize(
    ("lost", "when", "said"),
    [
        (20, "meanwhile", "this computer did not run labctl"),
        (60, "meanwhile", "imu: readings lost"),  # more than the unit sends in the stall
        (20, "later", "imu: readings lost"),  # in the same data set, while labctl ran
    ],
)
def test_a_stall_explains_as_many_readings_lost_in_it_as_the_unit_sends_meanwhile(
    lost: int, when: str, said: str
) -> None:
    rig, reads = Busy(), [0]
    read = rig.imu.read

    def lossy(duration_s: float) -> Readings:
        reads[0] += bool(rig.journal.blocks)
        if reads[0] == 1:
            rig.stall(0.2)  # counted as 0.1 s, 3 s of the bench: 30 of 100 readings
        readings = read(duration_s)
        if reads[0] == (1 if when == "meanwhile" else 3) and len(readings):
            return replace(readings, lost=lost)
        return readings

    rig.imu.read = lossy
    assert rig.run().state is CampaignState.DONE
    (message,) = repeated(rig)
    assert message.startswith(f"data set 1 is taken again: {said}")


def test_a_lateness_of_milliseconds_is_measured_while_something_is_timed() -> None:
    lateness = Lateness(wall := VirtualClock())
    for late_s in (0.0, 0.06, 0.004):
        lateness.look()
        wall.sleep(SHORT_PERIOD_S + late_s)
    lateness.look()
    assert lateness.largest_s == pytest.approx(0.06)


def test_no_lateness_is_measured_where_the_clock_stands_still_meanwhile() -> None:
    with HostStalls(VirtualClock()).lateness() as lateness:
        pass
    assert lateness.largest_s == 0.0


@pytest.mark.parametrize(("stalled_s", "said"), [(0.5, "no answer in time, but this computer did not"), (0.15, "gone")])
def test_a_chamber_that_does_not_answer_is_excused_by_a_stall_of_most_of_the_time(stalled_s: float, said: str) -> None:
    rig, silent = Busy(), [True]

    def late() -> None:
        if silent:
            silent.clear()
            rig.stall(stalled_s)  # times 30 of the bench, less 3 s
            rig.slept(6.0)
            raise NoReply("chamber", "gone")

    rig.when_step("soak", lambda: rig.chamber.faults.update(read=late))
    assert rig.run().state is CampaignState.DONE
    (event,) = [each for each in rig.journal.events if each.kind == "link.degraded"]
    assert said in event.message
