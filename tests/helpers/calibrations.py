"""Calibrations of made-up recordings, and readings within their range."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from labctl.calibration import Calibration, build_calibration
from labctl.fitting import fit
from labctl.recording import Recording

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def calibrated(recording: Recording, model: str | None = None, effects: list[str] | None = None) -> Calibration:
    result = fit(recording, model, effects)
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={"recording": 1})


def inside(calibration: Calibration, n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return rng.uniform(slow, fast, (n, len(calibration.axes))) * 0.9, rng.uniform(low, high, n)
