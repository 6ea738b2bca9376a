"""Recordings at rest with noise of known size."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np

from labctl.recording import Recording, RecordingInfo

PERIOD_S = 0.1


def noise(seed: int, n: int, n_walk: float = 0.0, instability: float = 0.0, rate_walk: float = 0.0) -> np.ndarray:
    """Return rates in deg/s with noise of known N (deg/sqrt(s)), B (deg/s) and K (deg/s/sqrt(s))."""
    rng = np.random.default_rng(seed)
    rates = n_walk / math.sqrt(PERIOD_S) * rng.normal(size=n)
    rates += rate_walk * math.sqrt(PERIOD_S) * np.cumsum(rng.normal(size=n))
    frequency = np.fft.rfftfreq(2 * n)[1:]
    phases = rng.normal(size=n) + 1j * rng.normal(size=n)
    flicker = np.fft.irfft(np.concatenate([[0], phases / np.sqrt(2 * frequency)]))[:n] * math.sqrt(2 * n)
    return rates + instability / math.sqrt(2 * math.pi) * flicker  # one-sided density B^2 / (pi f)


def resting(rates: np.ndarray, **columns: np.ndarray) -> Recording:
    """Return samples of one axis at rest at 25 deg C; `columns` replace what is said of them."""
    n = len(rates)
    info = RecordingInfo(
        serial="S",
        model="m",
        axes=("z",),
        kind="samples",
        technology="fog",
        started_at=datetime(2026, 1, 1, tzinfo=UTC),
    )
    plain = {
        "dataset": np.ones(n, dtype=np.int64),
        "t_s": PERIOD_S * np.arange(n),
        "table_rate_dps": np.zeros(n),
        "temperature_c": np.full(n, 25.0),
        "gyro_z": rates,
    }
    return Recording(info, {**plain, **columns})


def with_record_at_rest(minutes: float, instability: float) -> Recording:
    """Return 20 short data sets at rest and at rates, and a long one at rest."""
    n = round(60 * minutes / PERIOD_S)
    parts = [20] * 40 + [n]
    dataset = np.repeat(np.arange(1, 42), parts)
    total = len(dataset)
    rate = np.repeat([*np.tile([-20.0, -10.0, 10.0, 20.0], 10), 0.0], parts)
    t_s = PERIOD_S * np.arange(total) + 30.0 * (dataset - 1)
    rates = rate * 1.001 + noise(3, total, n_walk=5e-4, instability=instability)
    return resting(rates, dataset=dataset, t_s=t_s, table_rate_dps=rate)
