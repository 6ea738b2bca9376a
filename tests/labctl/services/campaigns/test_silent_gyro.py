"""A gyro that is silent in the middle of a data set, through the bytes of a real table: the step is begun again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from instruments.bench import open_bench
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.mark.slow
@pytest.mark.parametrize("silent_s", [2.0, 9.0, 11.0, 18.0])
def test_a_table_that_still_turns_is_stopped_before_the_step_is_begun_again(store: Store, silent_s: float) -> None:
    bench, clock = load_bench("single-axis-sim"), VirtualClock()
    simulation = open_simulation(bench, clock)
    prepared = prepare(store, "short", bench, clock, clip=False, opened=open_bench(bench, clock, simulation))
    simulation.faults("sim://kvh-rd2100/fog").arm("silence", from_s=737.0, until_s=737.0 + silent_s)
    ended = run(store, prepared)
    assert ended.state == "done", ended.reason
    events = [event.kind for event in store.campaigns.events(prepared.id)]
    assert "data_set_repeated" in events or "link.degraded" in events
    sets = store.recordings.points(ended.recordings["FOG-0001"]).columns
    assert len(sets["n"]) == len(set(sets["dataset"].tolist())) == 15
