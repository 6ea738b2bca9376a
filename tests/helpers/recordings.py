"""Recordings made by plain formulas."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import numpy as np

from labctl.recording import Recording, RecordingInfo
from tests.helpers.simulated_recordings import single_axis

TABLE_1_C = np.arange(-40.0, 51.0, 10.0)
TABLE_2_DPS = np.array([0.0, *(s * r for r in (0.1, 1, 10, 50, 100, 150, 200, 250, 300, 400) for s in (1, -1))])
STARTED = datetime(2026, 1, 5, 8, tzinfo=UTC)


def ou_drift(t_s: np.ndarray, size: float, taus_s: tuple[float, ...], rng: np.random.Generator) -> np.ndarray:
    """Return a sum of Ornstein-Uhlenbeck processes with `size` standard deviation in all, at rising times."""
    total = np.zeros(len(t_s))
    for tau in taus_s:
        value = rng.normal()
        previous = t_s[0]
        for i, t in enumerate(t_s):
            keep = np.exp(-(t - previous) / tau)
            value = keep * value + np.sqrt(1 - keep**2) * rng.normal()
            total[i] += value * size / np.sqrt(len(taus_s))
            previous = t
    return total


class Triaxial:
    """A tri-axial unit whose K and B are smooth in temperature, on Table 1 x Table 2 in three runs."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.k25 = np.array([[1.0005, 0.0188, 0.0012], [-0.0187, 1.0005, 5e-4], [0.0011, 7.5e-4, 1.0017]])
        self.k25 += rng.normal(0, 1e-3, (3, 3))
        self.slope = rng.normal(0, 1e-4, 3)
        self.b = rng.normal(0, 0.03, (3, 3)) * np.array([[1.0, 0.3, 0.2]])

    def k(self, temperature_c: float) -> np.ndarray:
        return self.k25 + np.diag(self.slope) * (temperature_c - 25)

    def bias(self, temperature_c: float) -> np.ndarray:
        u = (temperature_c - 5) / 45
        return self.b @ np.array([1.0, u, u * u])

    def campaign(self, seed: int, white: float = 0.01, drift: float = 0.0015) -> Recording:
        rng = np.random.default_rng([seed, 7])
        rows: list[tuple[Any, ...]] = []
        t = 0.0
        for run, position in enumerate("xyz", start=1):
            for level in TABLE_1_C:
                t += 5400.0
                for rate in TABLE_2_DPS:
                    t += 75.0
                    rows.append((t, run, position, rate, level + rng.normal(0, 0.02)))
        t_s = np.array([r[0] for r in rows])
        run = np.array([r[1] for r in rows])
        position = np.array([r[2] for r in rows])
        rate, temperature = np.array([r[3] for r in rows]), np.array([r[4] for r in rows])
        body = np.stack([np.where(position == axis, rate, 0.0) for axis in "xyz"], axis=1)
        truth = np.array([self.k(T) @ w + self.bias(T) for T, w in zip(temperature, body, strict=True)])
        noise = rng.normal(0, white / np.sqrt(60.0), truth.shape)
        for number in (1, 2, 3):
            for axis in range(3):
                rows_of_run = run == number
                noise[rows_of_run, axis] += ou_drift(t_s[rows_of_run], drift, (120.0, 700.0, 3600.0), rng)
        n = 600
        columns = {
            "dataset": np.arange(1, len(rows) + 1),
            "t_s": t_s,
            "run": run,
            "position": position,
            "table_rate_dps": rate,
            "temperature_c": temperature,
            "n": np.full(len(rows), n),
        }
        for index, axis in enumerate("xyz"):
            columns[f"gyro_{axis}"] = truth[:, index] + noise[:, index]
            columns[f"gyro_{axis}_std"] = np.full(len(rows), white * np.sqrt(n / 60.0))
        info = RecordingInfo(serial=f"SIM-{seed}", axes=("x", "y", "z"), kind="points", started_at=STARTED)
        return Recording(info, columns)


def points(rate: np.ndarray, temperature_c: np.ndarray, gyro: np.ndarray, **info: Any) -> Recording:
    """Return a single-axis recording of data-set means."""
    head = {"serial": "ONE", "axes": ("z",), "kind": "points", "started_at": STARTED, **info}
    n = len(rate)
    columns = {
        "dataset": np.arange(1, n + 1),
        "t_s": 60.0 * np.arange(n),
        "position": np.full(n, "z"),
        "run": np.ones(n, dtype=np.int64),
        "table_rate_dps": np.asarray(rate, dtype=np.float64),
        "temperature_c": np.asarray(temperature_c, dtype=np.float64),
        "gyro_z": np.asarray(gyro, dtype=np.float64),
    }
    return Recording(RecordingInfo(**head), columns)


def cycled(hysteresis_dps: float) -> Recording:
    """Return means of data sets up and down a temperature range at five rates, with points measured again."""
    rng = np.random.default_rng(2)
    warm = np.repeat([*range(20, 61, 5), *range(60, 19, -5)], 6).astype(float)
    rate = np.tile([-50.0, -20.0, 0.0, 20.0, 50.0, 0.0], 18)
    leg = np.repeat([1.0, -1.0], 54)
    n = len(rate)
    recording = single_axis(1)
    info = recording.info.model_copy(update={"kind": "points"})
    columns = {
        "dataset": np.arange(1, n + 1),
        "t_s": 60.0 * np.arange(n),
        "table_rate_dps": rate,
        "temperature_c": warm + rng.normal(0, 0.02, n),
        "gyro_z": rate * 1.002 + 0.01 + hysteresis_dps * leg + rng.normal(0, 5e-4, n),
        "gyro_z_std": np.full(n, 5e-3),
        "n": np.full(n, 100),
    }
    return Recording(info, columns)
