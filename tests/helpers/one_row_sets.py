"""Recordings of very many data sets of one reading: the most rows that an import of few bytes can ask for."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from labctl.recording import Recording, RecordingInfo

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def one_row_sets(sets: int, serial: str = "G-1", *, per_set: int = 1) -> Recording:
    """Return samples of so many data sets, with as many readings each and 100 rows of environment."""
    n = sets * per_set
    draw = np.random.default_rng(1)
    columns = {
        "dataset": np.repeat(np.arange(1, sets + 1), per_set),
        "t_s": np.arange(n) * 0.1,
        "position": np.full(n, "z"),
        "run": np.ones(n, dtype=np.int64),
        "mounting": np.ones(n, dtype=np.int64),
        "table_rate_dps": np.repeat(draw.uniform(-100, 100, sets), per_set),
        "temperature_c": draw.normal(25, 0.1, n),
        "gyro_z": draw.normal(0, 1, n),
    }
    environment = {"t_s": np.arange(100.0), "run": np.ones(100, dtype=np.int64), "temperature_c": np.full(100, 25.0)}
    info = RecordingInfo(serial=serial, model="M", axes=("z",), kind="samples", started_at=AT, technology="fog")
    return Recording(info, columns, environment)
