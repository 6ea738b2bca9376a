"""One recipe twice: in virtual time in this process, and in scaled time against simulators in another process."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from numpy.typing import NDArray

from instruments.bench_config import read_bench
from labctl.answers.campaigns import BENCH_CHECKS, StartRequest
from labctl.services.campaigns.execution import run_here
from labctl.store import open_store
from tests.helpers.processes import begin_loaded

#: A unit counts as silent after 2 s of the bench, half a second of real time: a machine that is busy otherwise stalls
#: for less.
SPEED = 4.0
RECIPE = """
format = "labctl-recipe/1"
name = "two-processes"
temperatures_c = [25, 25.5]
rates_dps = [-40, 0, 40]
positions = ["z"]
[soak]
hold_s = 10
max_drift_c = 2.0
drift_window_s = 10
timeout_s = 1800
[acquire]
duration_s = 10
settle_s = 2
[guards]
stale_s = 600
"""

#: What is far is not known to be simulated.
LOOKED_AT: dict[str, Any] = {"confirmed_by": "a test", "checks": list(BENCH_CHECKS)}


def bench_file(folder: Path) -> Path:
    """A fibre-optic gyro on two serial lines, and a chamber on the network."""
    bench = read_bench("single-axis-sim").model_dump(exclude_none=True)
    bench["chamber"] = read_bench("triaxial-sim").model_dump(exclude_none=True)["chamber"]
    path = folder / "near.toml"
    path.write_text(tomli_w.dumps(bench))
    return path


@pytest.fixture
def far_bench(tmp_path: Path) -> Iterator[Path]:
    """The same bench on real pseudo-terminals and a real TCP port, in a process of its own."""
    bench = tmp_path / "far.toml"
    command = ["simulator", str(bench_file(tmp_path)), "--out", str(bench), "--speed", str(SPEED), "--json"]
    with begin_loaded(command) as simulator:
        try:
            assert simulator.stdout is not None
            said = json.loads(simulator.stdout.readline())
            assert said["addresses"]["table"].startswith("/dev/pts/")
            assert said["addresses"]["chamber"].startswith("127.0.0.1:")
            yield bench
        finally:
            simulator.terminate()


def data_sets(database: Path, campaign: int) -> Mapping[str, NDArray[Any]]:
    with open_store(str(database), write=False) as store:
        row = store.campaigns.get(campaign)
        return store.recordings.points(row.recordings["FOG-0001"]).columns


@pytest.mark.slow
def test_the_same_data_sets_within_noise(far_bench: Path, tmp_path: Path) -> None:
    recipe = tmp_path / "two-processes.toml"
    recipe.write_text(RECIPE)
    here, there = tmp_path / "here.sqlite", tmp_path / "there.sqlite"
    one = run_here(str(here), StartRequest(recipe=str(recipe), bench=str(bench_file(tmp_path))))
    two = run_here(str(there), StartRequest(recipe=str(recipe), bench=str(far_bench), **LOOKED_AT))
    assert (one.state, two.state) == ("done", "done"), (one.reason, two.reason)
    near, far = data_sets(here, one.id), data_sets(there, two.id)
    assert len(near["n"]) == len(far["n"]) == 6
    for name in ("position", "run", "mounting", "chamber_setpoint_c"):
        assert np.array_equal(near[name], far[name]), name
    assert np.all(np.diff(far["dataset"]) > 0)  # one that a stall of a busy machine ended is taken again, as the next
    assert far["table_rate_dps"] == pytest.approx(near["table_rate_dps"], rel=1e-12)
    # a reading counts by when it came: on a busy machine some come too late for the gate
    assert np.abs(np.asarray(far["n"]) - 100).max() <= 10
    # the output differs by noise and drift (0.0014 deg/s/rtHz, 0.0011 deg/s) and a little by temperature
    assert np.asarray(far["gyro_z"]) == pytest.approx(np.asarray(near["gyro_z"]), abs=0.02)
    assert np.asarray(far["temperature_c"]) == pytest.approx(np.asarray(near["temperature_c"]), abs=1.0)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    recipe = tmp_path / "two-processes.toml"
    recipe.write_text(RECIPE)
    contents = []
    for name in ("one.sqlite", "two.sqlite"):
        run_here(str(tmp_path / name), StartRequest(recipe=str(recipe), bench="single-axis-sim"))
        contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]
