"""The fit of ojeda2000 to 121 data sets, from points in memory."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from benchmarks.machine import describe, median_s
from labctl.fitting import fit
from labctl.recording import Recording, RecordingInfo


def run() -> dict[str, float | str]:
    """Return milliseconds for one fit with its noise grid and held-out errors."""
    rng = np.random.default_rng(1)
    rate, warm = np.tile(np.linspace(-100, 100, 11), 11), np.repeat(np.linspace(25, 45, 11), 11)
    output = rate + 0.2 + rate * (0.01 + 0.0003 * (warm - 35)) - 4e-7 * rate**3 + rng.normal(0, 1e-3, 121)
    columns = {
        "dataset": np.arange(1, 122),
        "t_s": 40.0 * np.arange(121),
        "position": np.full(121, "z"),
        "run": np.ones(121, dtype=np.int64),
        "table_rate_dps": rate,
        "temperature_c": warm,
        "gyro_z": output,
        "gyro_z_std": np.full(121, 0.0044),
        "n": np.full(121, 300),
    }
    info = RecordingInfo(serial="B", axes=("z",), kind="points", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    recording = Recording(info, columns)
    return {
        **describe("numpy", "scipy"),
        "ojeda2000_121_data_sets_ms": 1e3 * median_s(lambda: fit(recording, "ojeda2000")),
    }
