"""Campaigns through drivers, bytes and database, in virtual time."""

from __future__ import annotations

import hashlib
import signal
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import read_bench
from instruments.clock import VirtualClock
from labctl.answers.campaigns import StartRequest
from labctl.errors import Stopped
from labctl.fitting import fit
from labctl.services.campaigns import execution
from labctl.services.campaigns.execution import run, run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import open_store
from procedures.contracts.control import Control
from procedures.monitoring.progress import Progress

TINY = """format = "labctl-recipe/1"
name = "tiny"
temperatures_c = [10, 25, 40]
rates_dps = [-300, -40, 0, 40, 300]
positions = ["x", "y", "z"]
[soak]
hold_s = 1800
[acquire]
duration_s = 10
settle_s = 2
"""


def dump(location: str) -> str:
    with sqlite3.connect(location) as raw:
        text = "\n".join(raw.iterdump())
    raw.close()
    return hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    dumps = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        location = str(tmp_path / f"{name}.sqlite")
        answer = run_here(location, StartRequest(recipe="short", seed=seed))
        assert answer.state == "done"
        dumps.append(dump(location))
    assert dumps[0] == dumps[1]
    assert dumps[0] != dumps[2]


@pytest.mark.slow
def test_a_triaxial_campaign_finds_the_unit_as_it_was_made(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    with open_store(location, write=True) as store:
        bench = load_bench("triaxial-sim")
        prepared = prepare(store, TINY, bench, VirtualClock(), clip=False)
        answer = run(store, prepared)
        assert answer.state == "done", answer.reason
        recording = answer.recordings["STIM-0001"]
        points = store.recordings.points(recording)
        readings = store.recordings.get(recording).readings
        environment = points.environment
    assert len(points) == 45
    assert readings == pytest.approx(45 * 10 * 125, rel=0.01)
    assert environment is not None
    assert np.max(np.diff(environment["t_s"])) <= 10.0 + 2.0
    result = fit(points, "yang2018")
    truth = prepared.bench.simulation.world.gyro("mems").truth  # type: ignore[union-attr]
    for row, axis in enumerate("xyz"):
        found = result.fitted.axes[axis]
        for node, warm in enumerate(result.fitted.model.temperature.nodes_c):  # type: ignore[union-attr]
            k, b = truth.k(warm), truth.b(warm)
            values = dict(zip(found.names, found.values[:, node], strict=True))
            assert values["bias"] == pytest.approx(b[row], abs=0.01)
            assert 1 + values["scale_factor"] == pytest.approx(k[row, row], abs=1e-4)
            for column, other in enumerate("xyz"):
                if other != axis:
                    assert values[f"misalignment_{other}"] == pytest.approx(k[row, column], abs=1e-4)


def test_readings_are_kept_when_a_campaign_is_aborted(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        control = Control()

        def stop_in_the_middle(progress: object) -> None:
            if "data set 4" in progress.step_text:  # type: ignore[attr-defined]
                control.abort("enough")

        answer = run(store, prepared, control, stop_in_the_middle)
        assert answer.state == "aborted"
        assert "enough" in answer.reason
        assert len(store.recordings.points(1)) == 3
        table, chamber = prepared.bench.table, prepared.bench.chamber
        assert not table.is_moving()
        assert chamber.read().setpoint_c == read_bench("single-axis-sim").chamber.safe_c


def test_a_second_interrupt_does_not_take_away_how_the_campaign_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = execution._stopped

    def interrupted_again(*arguments: Any) -> str:
        signal.raise_signal(signal.SIGINT)
        return said(*arguments)

    def interrupt(progress: Progress) -> None:
        if "data set 2" in progress.step_text:
            raise KeyboardInterrupt

    monkeypatch.setattr(execution, "_stopped", interrupted_again)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False)
        with pytest.raises(Stopped, match="campaign 1 was stopped; bench single-axis-sim is safe"):
            run(store, prepared, observe=interrupt)


def test_the_whole_plan_is_written_down_before_the_first_move(tmp_path: Path) -> None:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "table1-x-table2", load_bench("triaxial-sim"), VirtualClock(), clip=False)
        steps = store.campaigns.steps(prepared.id)
        assert {step.state for step in steps} == {"planned"}
        assert sum(step.kind == "acquire" for step in steps) == 630
        prepared.bench.close()
