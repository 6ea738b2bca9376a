"""Recordings of a table whose rate changes, worked out step by step on a fine grid of times."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from labctl.recording import Recording, RecordingInfo

Rates = NDArray[np.float64]
#: Steps of the fine grid from one reading to the next.
FINE = 20


def sweep(duration_s: float, low_hz: float, high_hz: float, amplitude_dps: float, sample_hz: float) -> Rates:
    """Return a logarithmic sine sweep on the fine grid, (n,) deg/s, that begins and ends at rest."""
    t_s = _fine(duration_s, sample_hz)
    growth = np.log(high_hz / low_hz) / duration_s
    fade = np.clip(np.minimum(t_s, duration_s - t_s) / 2.0, 0.0, 1.0)
    return np.asarray(amplitude_dps * fade * np.sin(2 * np.pi * low_hz * np.expm1(growth * t_s) / growth))


def ramp(duration_s: float, from_dps: float, to_dps: float, sample_hz: float) -> Rates:
    """Return a straight ramp on the fine grid, (n,) deg/s."""
    return np.linspace(from_dps, to_dps, len(_fine(duration_s, sample_hz)))


def profile_recording(
    rate_dps: Rates, sample_hz: float = 100.0, *, delay_s: float = 0.0, bandwidth_hz: float | None = None,
    scale: float = 0.0, bias_dps: float = 0.0, noise_dps: float = 0.02, seed: int = 1,
) -> Recording:  # fmt: skip
    """Return readings of one axis: means of the fine grid over each interval, in one data set.

    The gyro follows by the trapezoidal rule of T dy/dt + y = rate, and is then late by `delay_s`, a whole number of
    fine steps.
    """
    fine_hz = sample_hz * FINE
    seen = rate_dps
    if bandwidth_hz is not None:
        c = np.pi * bandwidth_hz / fine_hz
        seen = np.asarray(
            lfilter([c / (1 + c)] * 2, [1, -(1 - c) / (1 + c)], seen - rate_dps[0]) + rate_dps[0], dtype=np.float64
        )
    late = round(delay_s * fine_hz)
    seen = np.concatenate([np.full(late, seen[0]), seen[: len(seen) - late]])
    rng = np.random.default_rng(seed)
    output = (1 + scale) * _readings(seen) + bias_dps
    n = len(output)
    info = RecordingInfo(
        serial="G1", axes=("z",), kind="samples", motion="profile", started_at=datetime(2026, 1, 1, tzinfo=UTC)
    )
    whole = np.ones(n, dtype=np.int64)
    return Recording(info, {
        "dataset": whole, "t_s": np.arange(1, n + 1) / sample_hz, "position": np.full(n, "z"), "run": whole,
        "mounting": whole, "table_rate_dps": _readings(rate_dps), "temperature_c": rng.normal(25.0, 0.02, n),
        "gyro_z": output + rng.normal(0.0, noise_dps, n),
    })  # fmt: skip


def _fine(duration_s: float, sample_hz: float) -> Rates:
    return np.arange(round(duration_s * sample_hz) * FINE) / (sample_hz * FINE)


def _readings(fine: Rates) -> Rates:
    return np.asarray(fine.reshape(-1, FINE).mean(axis=1))
