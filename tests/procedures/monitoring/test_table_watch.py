"""A table that stops or falls silent in the middle of a data set ends it at once; it is asked often enough for that."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest

from instruments.bench import open_bench
from instruments.bench_config import read_bench
from instruments.clock import VirtualClock
from instruments.errors import LinkError, NoReply
from instruments.interfaces.table import Spin
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.errors import TableStopped
from procedures.monitoring.table_watch import ASK_EVERY_S, TableWatch
from tests.helpers.engine_rig import Rig
from tests.helpers.fake_instruments import FakeTable

#: The longest that a table may be without a question, s.
LIMIT_S = 30.0
LONG = {"acquire": {"duration_s": 200.0, "settle_s": 2.0, "max_duration_s": 300.0}}


class TimedTable(FakeTable):
    """Notes when the controller was spoken to."""

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig.clock, rig.trace, "table")
        self.times: list[tuple[str, float]] = []

    def called(self, method: str) -> None:
        self.times.append((method, self.clock.now_s()))
        super().called(method)

    def is_moving(self) -> bool:
        self.times.append(("is_moving", self.clock.now_s()))
        return super().is_moving()


@pytest.mark.parametrize("settle_s", [2.0, 100.0])
@pytest.mark.parametrize("rate_dps", [0.0, 20.0, 350.0])
def test_a_table_is_asked_at_least_every_30_s_of_a_long_data_set(rig: Rig, rate_dps: float, settle_s: float) -> None:
    table = rig.table = TimedTable(rig)
    changes = {"acquire": {**LONG["acquire"], "settle_s": settle_s}, "rates_dps": [rate_dps]}
    assert rig.run(rig.recipe(**changes)).state == CampaignState.DONE
    spins = [index for index, (method, _) in enumerate(table.times) if method == "spin"]
    assert spins
    for start in spins:
        end = next(index for index in range(start, len(table.times)) if table.times[index][0] == "settle")
        heard_s = [t_s for _, t_s in table.times[start : end + 1]]
        silences_s = [later - before for before, later in pairwise(heard_s)]
        assert max(silences_s) <= LIMIT_S
        assert len(heard_s) > 200 / LIMIT_S


def stop_after(table: FakeTable, n: int, act: Any) -> None:
    """Do something at the n-th question whether the table moves."""
    asked = [0]

    def fault() -> None:
        asked[0] += 1
        if asked[0] == n:
            act()

    table.faults["is_moving"] = fault


def test_a_table_that_stops_in_a_data_set_ends_it_at_once(rig: Rig) -> None:
    stop_after(rig.table, 4, lambda: setattr(rig.table, "moving", False))
    outcome = rig.run(rig.recipe(**LONG, rates_dps=[20.0]))
    assert outcome.state == CampaignState.FAILED
    assert "table: stands still" in outcome.reason
    assert "s after the beginning of a run at 20.0002 deg/s" in outcome.reason
    ((_, state, reason),) = rig.journal.closed
    assert (state, reason) == ("partial", outcome.reason)
    rig.assert_safe()


def test_a_table_that_moves_in_a_data_set_at_rest_ends_it_at_once(rig: Rig) -> None:
    stop_after(rig.table, 4, lambda: setattr(rig.table, "moving", True))
    outcome = rig.run(rig.recipe(**LONG, rates_dps=[0.0]))
    assert outcome.state == CampaignState.FAILED
    assert "table: moves" in outcome.reason
    assert "s after the beginning of a rest" in outcome.reason
    rig.assert_safe()


@pytest.mark.parametrize(("error", "times"), [(NoReply("table", "no answer"), 2), (LinkError("table", "gone"), 1)])
def test_a_table_that_does_not_answer_ends_the_data_set(rig: Rig, error: Exception, times: int) -> None:
    began_s, closed_s = list[float](), list[float]()

    def hook(what: str, _detail: Any) -> None:
        if what == "dataset_opened":
            began_s.append(rig.clock.now_s())
            rig.table.fail("is_moving", error, times)
        if what == "dataset_closed":
            closed_s.append(rig.clock.now_s())

    rig.journal.hooks.append(hook)
    rig.run(rig.recipe(**LONG, rates_dps=[20.0]))
    assert rig.journal.closed[0][1:] == ("partial", str(error))
    assert closed_s[0] - began_s[0] <= ASK_EVERY_S + 1.0
    rig.assert_safe()


def test_one_lost_reply_is_no_fault(rig: Rig) -> None:
    rig.when_step("acquire", lambda: rig.table.fail("is_moving", NoReply("table", "no answer"), 1))
    assert rig.run(rig.recipe(**LONG, rates_dps=[20.0])).state == CampaignState.DONE


def test_no_question_before_it_is_due(rig: Rig) -> None:
    now_s = rig.clock.now_s()
    watch = TableWatch(rig.table, rig.clock, Spin(20.0, 20.0, now_s, now_s + 100.0, 0.0))
    rig.clock.sleep(ASK_EVERY_S - 0.2)  # a ramp of 0.1 s before
    watch.ask()  # raises nothing yet
    rig.clock.sleep(0.2)
    with pytest.raises(TableStopped):
        watch.ask()


@pytest.mark.parametrize(
    ("fault", "error"), [("stall", TableStopped), ("silence", NoReply), ("dropped_link", LinkError)]
)
def test_the_simulated_controller_shows_it_through_its_driver(fault: Any, error: type[Exception]) -> None:
    clock, bench_file = VirtualClock(), read_bench("single-axis-sim")
    bench = open_bench(bench_file, clock)
    assert bench.simulation is not None
    faults = bench.simulation.faults(bench_file.table.port)
    bench.table.home()
    if fault == "stall":
        faults.arm(fault, count=1)
    spin = bench.table.spin(20.0, 200.0)
    watch = TableWatch(bench.table, clock, spin)
    if fault != "stall":
        faults.arm(fault, from_s=clock.now_s() + 60.0)
    until_s = clock.now_s() + 60.0 + 2 * ASK_EVERY_S

    def watching() -> None:
        while clock.now_s() < until_s:
            clock.sleep(1.0)
            watch.ask()

    with pytest.raises(error):
        watching()
    faults.clear()
    bench.table.stop()
    assert not bench.table.is_moving()
    bench.close()


def test_questions_do_not_take_the_end_of_a_run_from_the_driver() -> None:
    clock = VirtualClock()
    bench = open_bench(read_bench("single-axis-sim"), clock)
    bench.table.home()
    spin = bench.table.spin(-20.0, 200.0)
    watch = TableWatch(bench.table, clock, spin)
    while clock.now_s() < spin.steady_until_s - 1.0:
        clock.sleep(1.0)
        watch.ask()
    bench.table.settle(spin)
    assert not bench.table.is_moving()
    bench.close()
