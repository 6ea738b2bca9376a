"""A gyro whose sample clock is its own: the manual of the DSP-3000 allows its 100 lines a second 3 % either way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomli_w

from instruments.bench_config import read_bench
from labctl.answers.campaigns import StartRequest
from labctl.services.campaigns.execution import run_here
from labctl.store import open_store

DURATION_S = 10.0  #: of a data set of the recipe "short"


def bench_of(folder: Path, clock_ppm: float) -> str:
    """Write a bench with a DSP-3000 whose lines come faster than its bench file says; returns its path."""
    record = read_bench("single-axis-sim").model_dump(mode="json", exclude_none=True)
    changes = {"driver": "kvh-dsp3000", "port": "sim://kvh-dsp3000/fog", "name": "fog", "sample_rate_hz": 100.0}
    record["gyros"][0] |= {**changes, "max_rate_dps": 375.0}
    record["simulation"] |= {"units": {"fog": {"sample_clock_ppm": clock_ppm}}}
    path = folder / "bench.toml"
    path.write_text(tomli_w.dumps(record), encoding="utf-8")
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [97.0, 103.0])
def test_a_campaign_loses_nothing_and_its_times_are_those_of_the_device(tmp_path: Path, rate_hz: float) -> None:
    database = str(tmp_path / "lab.sqlite")
    bench = bench_of(tmp_path, 1e6 * (rate_hz / 100.0 - 1.0))
    answer = run_here(database, StartRequest(recipe="short", bench=bench))
    assert (answer.state, answer.reason) == ("done", "all steps done")
    with open_store(database, write=False) as store:
        (recording,) = answer.recordings.values()
        heads = store.recordings.data_sets(recording)
        assert len(heads) == 15
        assert [(head.lost, head.damaged) for head in heads] == [(0, 0)] * 15
        for _, columns in store.recordings.iter_datasets(recording):
            t_s = np.asarray(columns["t_s"], dtype=np.float64)
            assert abs(len(t_s) - rate_hz * DURATION_S) <= 1
            assert (len(t_s) - 1) / (t_s[-1] - t_s[0]) == pytest.approx(rate_hz, rel=1e-5)


def test_a_gyro_that_sends_at_another_rate_is_named_with_its_rate(tmp_path: Path) -> None:
    answer = run_here(str(tmp_path / "lab.sqlite"), StartRequest(recipe="short", bench=bench_of(tmp_path, 1e5)))
    assert answer.state == "failed"
    assert "fog: sends 110 readings/s on sim://kvh-dsp3000/fog, but the bench file says 100, limit +-4 %" in (
        answer.reason
    )
