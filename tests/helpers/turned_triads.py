"""Recordings in poses of a gyro, an accelerometer and a magnetometer: simulated by NumPy alone, written as folders."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from labctl.recording import Recording, write_recording
from studies.triads import ABOUT_C, recording_of
from studies.triads_simulation import TrueTriads, Warming, turned_by_hand, warmed_k


def unit_of(seed: int) -> TrueTriads:
    """Return a simulated unit."""
    return TrueTriads.drawn(np.random.default_rng(seed))


def write_turned(
    folder: Path, unit: TrueTriads, rests: int, seed: int = 5, *, warm: bool = False, serial: str = "TRIADS-1"
) -> Path:
    """Write a session of `rests` rests; `warm`: at four temperatures, over which the accelerometer changes."""
    t_s, rate, force, field = turned_by_hand(seed, unit, rests)
    away_k = warmed_k(len(t_s))
    if warm:
        force = Warming.drawn(np.random.default_rng(seed + 1)).readings(unit, force, away_k)
    made = recording_of(t_s, rate, force, field)
    columns = {**made.columns, "temperature_c": ABOUT_C + away_k} if warm else made.columns
    info = made.info.model_copy(update={"serial": serial})
    write_recording(Recording(info, columns), folder)
    return folder
