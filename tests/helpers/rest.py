"""Recordings at rest: one data set through temperature loops, with or without a thermometer."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from labctl.recording import Recording, RecordingInfo
from labctl.recording.checks import checked

RATE_HZ = 2.0
#: Of one reading, deg/s.
NOISE_DPS = 0.003


def loop_course(minutes: float = 160.0, loops: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Return times, s, and a temperature that goes from 0 to 60 deg C and back, evenly."""
    t_s = np.arange(0.0, minutes * 60.0, 1.0 / RATE_HZ)
    phase = t_s / (minutes * 60.0) * loops
    return t_s, 60.0 * (1.0 - np.abs(2.0 * (phase % 1.0) - 1.0))


def follow(warm: np.ndarray, tau_s: float) -> np.ndarray:
    """Return a first-order follower of a temperature, reading by reading."""
    found = np.empty_like(warm)
    now = float(warm[0])
    for k, there in enumerate(warm.tolist()):
        now += (there - now) * -np.expm1(-1.0 / RATE_HZ / tau_s)
        found[k] = now
    return found


def flowing(
    laws: dict[str, Callable[[np.ndarray], np.ndarray]], *, minutes: float = 160.0, seed: int = 1, dps_k: float = 2e-3
) -> Recording:
    """Return readings of a unit at rest, axis -> a law from the temperature to that of its element, reading by reading.

    Each K between the two makes an error of `dps_k`, deg/s.
    """
    rng = np.random.default_rng(seed)
    t_s, warm = loop_course(minutes)
    columns: dict[str, np.ndarray] = {"dataset": np.ones(len(t_s), dtype=np.int64), "t_s": t_s, "temperature_c": warm}
    for k, (axis, law) in enumerate(laws.items()):
        bias = 0.1 * (k + 1) + 2e-3 * warm - 1e-5 * (k + 1) * warm**2 + dps_k * (law(warm) - warm)
        columns[f"gyro_{axis}"] = bias + rng.normal(0, NOISE_DPS, len(t_s))
    about = {"serial": "REST-2", "technology": "mems", "sample_rate_hz": RATE_HZ, "axes": tuple(laws)}
    info = RecordingInfo.model_validate(
        {"kind": "samples", "motion": "rest", "started_at": datetime(2026, 1, 5, tzinfo=UTC), **about}
    )
    return Recording(info, checked(Path("samples"), info, columns))


def at_rest(
    axes: tuple[str, ...] = ("x", "y", "z"),
    *,
    thermometer: bool = True,
    lag_s: float = 0.0,
    minutes: float = 160.0,
    seed: int = 1,
    **head: object,
) -> Recording:
    """Return readings of a unit at rest, checked as an import checks them; a lag makes 2e-3 deg/s for each K behind."""
    rng = np.random.default_rng(seed)
    t_s, warm = loop_course(minutes)
    columns: dict[str, np.ndarray] = {"dataset": np.ones(len(t_s), dtype=np.int64), "t_s": t_s}
    if thermometer:
        columns["temperature_c"] = warm
    for k, axis in enumerate(axes):
        law = (
            0.1 * (k + 1) + 2e-3 * warm - 1e-5 * (k + 1) * warm**2 if thermometer else np.full(len(t_s), 0.1 * (k + 1))
        )
        if lag_s:
            law = law + 2e-3 * (follow(warm, lag_s) - warm)
        columns[f"gyro_{axis}"] = law + rng.normal(0, NOISE_DPS, len(t_s))
    about = {"serial": "REST-1", "technology": "mems", "sample_rate_hz": RATE_HZ, **head}
    info = RecordingInfo.model_validate(
        {"axes": axes, "kind": "samples", "motion": "rest", "started_at": datetime(2026, 1, 5, tzinfo=UTC), **about}
    )
    return Recording(info, checked(Path("samples"), info, columns))
