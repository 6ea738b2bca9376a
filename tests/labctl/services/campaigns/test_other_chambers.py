"""A short campaign in each simulated chamber, through its bytes: same recipe, same unit, the same calibration data."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.store import Store, open_store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def in_chamber(**chamber: Any) -> BenchFile:
    record = read_bench("single-axis-sim").model_dump()
    record["chamber"] |= chamber
    return BenchFile.model_validate(record)


#: PyMeasure's class for the Thermotron 3800, in the place of the driver here.
PYMEASURE = {
    "driver": "library-chamber",
    "instrument": "pymeasure.instruments.thermotron:Thermotron3800",
    "start": "run",
    "program": "mode",
    "program_mask": 1,
}


@pytest.mark.slow
@pytest.mark.parametrize("chamber", ["espec", "weiss-simserv", "weiss-ascii2", "thermotron", "binder", "pymeasure"])
def test_a_campaign(store: Store, chamber: str, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = VirtualClock()
    if chamber == "pymeasure":
        bench = in_chamber(**PYMEASURE, port="sim://thermotron")
        assert bench.simulation is not None
        bench.simulation.chamber["acknowledges"] = False
        monkeypatch.setattr("pymeasure.instruments.thermotron.thermotron3800.sleep", clock.sleep)
    else:
        bench = in_chamber(driver=chamber, port=f"sim://{chamber}")
    prepared = prepare(store, "short", bench, clock, clip=False, opened=open_bench(bench, clock))
    ended = run(store, prepared)
    assert ended.state == "done", ended.reason
    taken_s = max(step.ended_s or 0.0 for step in store.campaigns.steps(prepared.id))
    assert taken_s == pytest.approx(prepared.plan.expected_s, rel=0.1)  # as planned, on each of these
    columns = store.recordings.points(ended.recordings["FOG-0001"]).columns
    assert len(columns["dataset"]) == 15
    chamber_c = np.asarray(columns["chamber_c"], dtype=float).reshape(3, 5).mean(axis=1)
    assert chamber_c == pytest.approx([24.0, 26.0, 28.0], abs=0.3)
