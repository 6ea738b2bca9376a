"""Exported calibrations: their files, what they state, and readings over the whole calibrated range."""

from __future__ import annotations

import itertools
import re

import numpy as np

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.exports import Written, written_calibration


def exported(calibration: Calibration, name: str, **options: str) -> tuple[str, Written]:
    """Return a file's text and what the export says of it."""
    written = written_calibration(calibration.to_bytes(), name, options)
    return written.content.decode(), written


def stated(text: str, before: str) -> float:
    """Return the number of a file's head after words, in deg/s."""
    found = re.search(re.escape(before) + r".*?(?:up to|at most) ([0-9.e+-]+) deg/s", text)
    assert found is not None, before
    return float(found[1])


def whole_range(calibration: Calibration, rates: int = 5, temperatures: int = 41) -> tuple[np.ndarray, np.ndarray]:
    """Return outputs (n, axes) and temperatures (n,): all rates of all axes together, edges too, and random ones."""
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    axes = len(calibration.axes)
    corners = np.array(list(itertools.product(np.linspace(slow, fast, rates), repeat=axes)))
    warm = np.linspace(low, high, temperatures)
    rng = np.random.default_rng(8)
    raw = np.vstack([np.repeat(corners, temperatures, axis=0), rng.uniform(slow, fast, (5000, axes))])
    return raw, np.concatenate([np.tile(warm, len(corners)), rng.uniform(low, high, 5000)])


def at_true_rate(calibration: Calibration, rate_dps: float, temperature_c: np.ndarray) -> np.ndarray:
    """Return outputs (n, axes) whose corrected rates are all `rate_dps`, by repeated correction."""
    compensator = Compensator(calibration)
    raw = np.full((len(temperature_c), len(calibration.axes)), rate_dps)
    for _ in range(20):
        raw = raw + rate_dps - compensator.compensate(raw, temperature_c).rate_dps
    return raw
