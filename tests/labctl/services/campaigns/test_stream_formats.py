"""Campaigns whose gyro is read by a stream format: through bytes, with a clock of its own, without a loss."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomli_w

from instruments.bench import open_bench
from instruments.bench_config import read_bench
from instruments.clock import VirtualClock
from instruments.protocols.stream_formats.document import shipped_formats
from labctl.answers.campaigns import StartRequest
from labctl.services.campaigns.execution import run_here
from labctl.store import open_store


def bench_of(folder: Path, format_: str, rate_hz: float, clock_ppm: float) -> str:
    """Write a bench and its gyro's format beside it; returns the path of the bench."""
    record = read_bench("triaxial-sim").model_dump(mode="json", exclude_none=True)
    (folder / "unit.toml").write_text(shipped_formats()[format_].read_text("utf-8"), encoding="utf-8")
    record["gyros"][0] |= {"driver": "stream-format", "format": "unit.toml", "port": "sim://stream-format/mems"}
    record["gyros"][0]["sample_rate_hz"] = rate_hz
    record["simulation"] |= {"units": {"mems": {"sample_clock_ppm": clock_ppm}}}
    path = folder / "bench.toml"
    path.write_text(tomli_w.dumps(record), encoding="utf-8")
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("format_", "rate_hz", "clock_ppm"), [("kvh-1750", 25, 0), ("xsens-mti", 20, 2e4), ("vectornav-vnimu", 20, -2e4)]
)
def test_a_campaign_by_a_format(tmp_path: Path, format_: str, rate_hz: float, clock_ppm: float) -> None:
    bench, database = bench_of(tmp_path, format_, rate_hz, clock_ppm), str(tmp_path / "lab.sqlite")
    answer = run_here(database, StartRequest(recipe="short", bench=bench))
    assert (answer.state, answer.reason) == ("done", "all steps done")
    simulation = open_bench(read_bench(bench), VirtualClock()).simulation
    assert simulation is not None
    truth = simulation.world.gyro("mems").truth
    with open_store(database, write=False) as store:
        assert store.campaigns.get(1).bench["gyros"][0]["format"]["name"]  # the whole format is kept, not its file
        (recording,) = answer.recordings.values()
        heads = store.recordings.data_sets(recording)
        assert [(head.lost, head.damaged) for head in heads] == [(0, 0)] * 15
        rates, means, warm = [], [], []
        for _, columns in store.recordings.iter_datasets(recording):
            t_s = np.asarray(columns["t_s"])
            assert (len(t_s) - 1) / (t_s[-1] - t_s[0]) == pytest.approx(rate_hz * (1 + 1e-6 * clock_ppm), rel=3e-5)
            assert np.asarray(columns["accel_z_g"]).mean() == pytest.approx(1.0, abs=2e-3)
            rates.append(np.asarray(columns["table_rate_dps"]).mean())
            means.append(np.asarray(columns["gyro_z"]).mean())
            warm.append(np.asarray(columns["temperature_c"]).mean())
    slope = float(np.polyfit(rates, means, 1)[0])
    assert slope == pytest.approx(truth.k(float(np.mean(warm)))[2, 2], abs=2e-4)
