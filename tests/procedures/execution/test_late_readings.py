"""A data set waits for readings that are on their way; what does not come is lost, and the data set is taken again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from instruments.errors import NoReply
from instruments.interfaces.gyro import Readings
from instruments.interfaces.self_checks import StreamPeriod
from procedures.contracts.campaign_state import CampaignState
from procedures.execution.late_readings import Promise, dropped, pending, promise_of
from procedures.monitoring.bench_snapshot import ReadingCounts
from tests.helpers.engine_rig import Rig
from tests.helpers.fake_instruments import FakeGyro


class HeldBack(FakeGyro):
    """A unit whose readings come `late_s` after they were made, from the read number `late_from` on."""

    late_s = 0.0

    def _index(self) -> int:
        made = super()._index() - round(self.late_s * self.sample_rate_hz)
        return max(made, self.next_sample)

    def temperature_c(self) -> float:
        return float(self.bench.chamber.air_c())


class Deaf(FakeGyro):
    """A unit of which every reading after the `alive` first of each data set is lost without a trace, `times` times."""

    alive, times = 80, 1

    def read(self, duration_s: float) -> Readings:
        readings = super().read(duration_s)
        opened = len(self.bench.journal.headers)
        if not self.times or opened > self.times:
            return readings
        kept = readings.t_s < self.bench.clock.now_s() if self.alive > self._came(opened) else readings.t_s < 0
        raw = {name: values[kept] for name, values in readings.raw.items()}
        return Readings(readings.t_s[kept], raw, readings.valid[kept])

    def _came(self, number: int) -> int:
        return sum(len(block[2]) for block in self.bench.journal.blocks if block[0] == number)


def with_unit(kind: type[FakeGyro]) -> Rig:
    rig = Rig()
    unit = kind(rig.clock, rig.trace, "imu")
    unit.bench = rig
    rig.gyros["imu"], rig.imu = unit, unit
    return rig


def came(rig: Any, number: int) -> int:
    return sum(len(readings) for dataset, _, readings, _ in rig.journal.blocks if dataset == number)


def lost(rig: Any, number: int) -> int:
    return sum(readings.lost for dataset, _, readings, _ in rig.journal.blocks if dataset == number)


@pytest.mark.parametrize("late_s", [0.3, 1.5])
def test_readings_that_are_held_back_are_waited_for(late_s: float) -> None:
    rig = with_unit(HeldBack)
    rig.imu.late_s = late_s
    assert rig.run().state is CampaignState.DONE
    for number in range(1, len(rig.journal.headers) + 1):
        assert came(rig, number) >= 98
        assert lost(rig, number) == 0
    assert "data_set_repeated" not in rig.journal.kinds()


def test_a_data_set_of_readings_in_time_does_not_wait() -> None:
    rig = with_unit(FakeGyro)
    rig.run()
    in_time = rig.clock.now_s()
    other = Rig()
    other.run()
    assert other.clock.now_s() == in_time
    assert {each for each in rig.journal.kinds() if "lost" in each} == set()


def test_a_chamber_that_is_late_to_answer_before_a_gate_costs_no_reading_of_it() -> None:
    rig, late = Rig(), [True]

    def answer_late() -> None:
        if late and rig.engine._context.monitor.is_taking_readings:
            late.clear()
            rig.clock.sleep(18.0)  # beyond the end of the gate
            raise NoReply("chamber", "no answer in 18 s")

    rig.chamber.faults["read"] = answer_late
    assert rig.run().state is CampaignState.DONE
    assert not late
    assert "link.degraded" in rig.journal.kinds()
    assert came(rig, 1) >= 98
    assert "data_set_repeated" not in rig.journal.kinds()


def test_what_never_comes_is_lost_is_said_and_the_data_set_is_taken_again() -> None:
    rig = with_unit(Deaf)
    assert rig.run().state is CampaignState.DONE
    assert rig.journal.closed[0][1] == "partial"
    assert came(rig, 1) + lost(rig, 1) == pytest.approx(100, abs=1)
    assert lost(rig, 1) >= 10
    assert came(rig, 2) >= 98
    (event,) = [each for each in rig.journal.events if each.kind == "readings_lost"]
    assert (
        event.message == f"imu: {lost(rig, 1)} of 100 readings of a data set did not arrive; they are counted as lost"
    )
    assert event.device == "imu"
    assert rig.journal.kinds().count("data_set_repeated") == 1


class Ends(Deaf):
    """A unit whose stream ends in the first data set, which is an error 2 s later."""

    alive, ended_s = 35, 0.0

    def read(self, duration_s: float) -> Readings:
        found = super().read(duration_s)
        if len(found) or len(self.bench.journal.headers) != 1:
            return found
        self.ended_s = self.ended_s or self.clock.now_s()
        if self.clock.now_s() > self.ended_s + 2.0:
            raise NoReply("imu", "no reading for 2.0 s: no bytes arrived; check power and cable")
        return found


def test_what_a_unit_did_not_send_before_its_silence_ended_a_data_set_is_lost() -> None:
    rig = with_unit(Ends)
    assert rig.run().state is CampaignState.DONE
    assert rig.journal.closed[0][1] == "partial"
    assert 35 <= came(rig, 1) <= 45
    assert 20 <= lost(rig, 1) <= 45  # until the error
    assert came(rig, 2) == pytest.approx(100, abs=1)
    assert lost(rig, 2) == 0


class EndsLate(Ends):
    """A unit whose driver keeps its newest readings back, until the stream ends in the first data set."""

    held: Readings | None = None

    def _came(self, number: int) -> int:
        return super()._came(number) + (0 if self.held is None else len(self.held))

    def read(self, duration_s: float) -> Readings:
        found = super().read(duration_s)
        if len(self.bench.journal.headers) != 1 or not len(found) or self._came(1) < 15:
            return found
        self.held = found if self.held is None else found.after(self.held)
        return replace(found.only(slice(0, 0)), lost=0)

    def kept_back(self) -> Readings | None:
        held, self.held = self.held, None
        return held


def test_what_was_kept_back_when_a_unit_fell_silent_is_in_the_data_set_and_not_lost() -> None:
    rig = with_unit(EndsLate)
    assert rig.run().state is CampaignState.DONE
    assert rig.journal.closed[0][1] == "partial"
    blocks = [readings.t_s for number, _, readings, _ in rig.journal.blocks if number == 1 and len(readings)]
    t_s = np.concatenate(blocks)
    assert 35 <= len(t_s) == came(rig, 1) <= 45  # as where nothing was kept back
    assert 20 <= lost(rig, 1) <= 45
    assert len(np.unique(t_s)) == len(t_s)
    assert np.diff(t_s) == pytest.approx(0.1)
    assert rig.imu.kept_back() is None


class Gap(FakeGyro):
    """A unit that loses readings from the last second of the first data set to 2 s later, and counts them."""

    lost_until_s = 0.0

    def read(self, duration_s: float) -> Readings:
        found = super().read(duration_s)
        came = sum(len(block[2]) for block in self.bench.journal.blocks if block[0] == 1)
        if len(self.bench.journal.headers) == 1 and came >= 90 and not self.lost_until_s:
            self.lost_until_s = self.clock.now_s() + 2.0
        if not self.lost_until_s or not len(found):
            return found
        kept = found.t_s >= self.lost_until_s
        self.missing = getattr(self, "missing", 0) + int((~kept).sum())
        if not kept.any():
            return replace(found.only(kept), lost=0)
        lost, self.missing, self.lost_until_s = self.missing, 0, self.lost_until_s if not kept.all() else -1.0
        return replace(found.only(kept), lost=lost)


def test_of_readings_lost_across_the_end_of_a_data_set_it_counts_its_own() -> None:
    rig = with_unit(Gap)
    assert rig.run().state is CampaignState.DONE
    assert came(rig, 1) + lost(rig, 1) == pytest.approx(100, abs=1)
    assert came(rig, 1) < 98
    assert came(rig, 2) + lost(rig, 2) == pytest.approx(100, abs=1)  # those lost before it are not its own
    assert came(rig, 2) >= 99


def test_where_they_are_lost_each_time_the_campaign_does_not_call_it_complete() -> None:
    rig = with_unit(Deaf)
    rig.imu.times = 10**6
    outcome = rig.run()
    assert outcome.state is CampaignState.FAILED
    assert "lost or damaged" in outcome.reason
    assert rig.journal.closed[0][1] == "partial"


def test_the_promise_is_by_the_measured_period_and_its_uncertainty() -> None:
    rig = Rig()
    assert promise_of(rig.imu, 10.0) == Promise(100.0, 0.0)
    unit: Any = rig.imu
    unit.period, unit.counter_step = StreamPeriod(0.1, None, 0.5), None
    assert promise_of(unit, 10.0) == Promise(100.0, 4.0)  # by the tolerance of a unit's own clock
    unit.period = StreamPeriod(0.1, 10.0 / 97, 1e-3)
    found = promise_of(unit, 10.0)
    assert found.readings == pytest.approx(97.0)
    assert found.u_readings == pytest.approx(0.388)
    assert (found.missing(95), found.missing(90)) == (0, 7)


def counted(times_s: list[float]) -> ReadingCounts:
    found = ReadingCounts(100.0)
    found.note(np.array(times_s), GATE[0])
    return found


GATE = (20.0, 30.0)


@pytest.mark.parametrize(("newest_s", "readings"), [(30.05, 0), (29.95, 0), (29.86, 0), (29.74, 2), (19.0, 100)])
def test_the_end_of_a_gate_is_pending_until_a_reading_of_its_last_period_came(newest_s: float, readings: int) -> None:
    assert pending(Rig().imu, GATE, counted([newest_s])) == pytest.approx(readings, abs=1)
    assert bool(pending(Rig().imu, GATE, counted([newest_s]))) == bool(readings)


@pytest.mark.parametrize(("first_s", "readings"), [(20.01, 0), (20.15, 0), (20.44, 4)])
def test_readings_that_a_late_reader_dropped_at_the_beginning_are_missing(first_s: float, readings: int) -> None:
    assert dropped(Rig().imu, GATE, counted([19.9, first_s, 21.0])) == readings
    assert dropped(Rig().imu, GATE, counted([19.9])) == 0
