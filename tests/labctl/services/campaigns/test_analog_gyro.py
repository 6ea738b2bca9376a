"""A short campaign with an analog gyro on a LabJack at a kilohertz, through its bytes: nothing lost, rates right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.store import open_store


@pytest.mark.slow
def test_a_campaign(tmp_path: Path) -> None:
    record = read_bench("gyrostar-sim").model_dump()
    gyro = record["gyros"][0] | {
        "driver": "labjack-t",
        "host": "sim://labjack-t7/gyrostar",
        "port": "sim://labjack-t7-stream/gyrostar",
        "sample_rate_hz": 1000,
        "options": {"average": 20, "thermometer_input": 1},
    }
    bench, clock = BenchFile.model_validate(record | {"gyros": [gyro]}), VirtualClock()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, "short", bench, clock, clip=False, opened=open_bench(bench, clock))
        ended = run(store, prepared)
        assert ended.state == "done", ended.reason
        recording = store.recordings.points(ended.recordings["GYROSTAR-0001"])
        rows = store.recordings.data_sets(ended.recordings["GYROSTAR-0001"])
    columns = {name: np.asarray(values) for name, values in recording.columns.items()}
    assert len(columns["dataset"]) == 15
    assert sum(row.lost + row.damaged for row in rows) == 0
    assert columns["n"] == pytest.approx(500, abs=30)  # 10 s of 50 readings per second, each of 20 scans
    output = (columns["gyro_z"].astype(float) - 2.5) / 0.022
    gain = np.polyfit(columns["table_rate_dps"].astype(float)[:5], output[:5], 1)[0]
    assert gain == pytest.approx(1.0, abs=0.01)
    assert recording.info.output["z"].unit == "V"
