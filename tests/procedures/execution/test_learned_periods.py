"""Before a data set a stream is read until its period is known, and further where its arrivals suggest another one."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.interfaces.self_checks import StreamPeriod
from instruments.transport.sample_timing import StreamTime
from procedures.contracts.campaign_state import CampaignState
from procedures.execution.record_readings import DOUBT_S, LEARN_S
from tests.helpers.engine_rig import Rig
from tests.helpers.fake_instruments import FakeGyro

HZ, WIDTH_S = 125.0, 0.0037


class Doubtful(FakeGyro):
    """A unit whose arrivals suggest another period until it was read for so long, s."""

    read_s, known_s, decided_s, counter_step = 0.0, 1.0, 0.0, None

    @property
    def period(self) -> StreamPeriod:
        if self.read_s < self.known_s:
            return StreamPeriod(0.1, None, 0.5)
        used_s = 0.1 if self.read_s < self.decided_s else 0.1003
        return StreamPeriod(0.1, 0.1003, 0.001, used_s)

    def read(self, duration_s: float):  # type: ignore[no-untyped-def]
        self.read_s += duration_s
        return super().read(duration_s)


@pytest.mark.parametrize(("decided_s", "expected_s"), [(0.0, 1.0), (5.0, 5.0), (1e9, 1.0 + DOUBT_S)])
def test_a_unit_whose_period_is_unconfirmed_is_read_until_it_is_not(decided_s: float, expected_s: float) -> None:
    rig = Rig()
    unit = Doubtful(rig.clock, rig.trace, "imu")
    unit.bench, unit.decided_s = rig, decided_s
    rig.gyros["imu"] = rig.imu = unit
    before: list[float] = []
    rig.journal.hooks.append(lambda what, _: before.append(unit.read_s) if what == "dataset_opened" else None)
    assert rig.run().state is CampaignState.DONE
    assert before[0] == pytest.approx(expected_s, abs=0.3)
    assert before[1] - before[0] < 13.0  # once after each start, not before each data set


@pytest.mark.parametrize("off_share", [2e-5, 2e-3, 3e-3])
def test_arrivals_decide_between_the_nominal_period_and_another_in_a_few_seconds(off_share: float) -> None:
    stream, rng, done = StreamTime(1 / HZ, 0.0, 0.005), np.random.default_rng(1), 0

    def listen(until_s: float) -> None:
        nonlocal done
        taken_s = np.arange(done + 1, int(until_s * HZ * (1 + off_share)) + 1) / (HZ * (1 + off_share))
        if len(taken_s):
            done += len(taken_s)
            looked_s = np.ceil((taken_s + rng.exponential(1e-4, len(taken_s))) / WIDTH_S) * WIDTH_S
            arrival_s = np.minimum(looked_s, until_s)
            stream.times(np.ones(len(taken_s), dtype=np.int64), until_s, width_s=WIDTH_S, arrival_s=arrival_s)

    now_s = 0.0
    while stream.known.measured_s is None:
        listen(now_s := now_s + 0.25)
    assert now_s < LEARN_S
    assert stream.known.is_unconfirmed == (off_share == 2e-3)  # the largest is excluded by now
    while stream.known.is_unconfirmed:
        listen(now_s := now_s + 1.5 / HZ)
    assert now_s < 8.0
    used_s = stream.known.used_s
    assert used_s is not None
    assert abs(used_s * HZ * (1 + off_share) - 1) < 2 * stream.known.u_share
