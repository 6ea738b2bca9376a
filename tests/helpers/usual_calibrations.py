"""Calibrations that many tests begin with: fitted once in a process, and given to each test as its own copy."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np

from labctl.calibration import Calibration
from tests.helpers.calibrations import calibrated
from tests.helpers.recordings import Triaxial, points

Grid = tuple[np.ndarray, np.ndarray]


def grid_11_by_11() -> Grid:
    """Return rates and temperatures of 121 data sets, temperature by temperature."""
    rate = np.tile(np.linspace(-100, 100, 11), 11)
    return rate, np.repeat(np.linspace(25, 45, 11), 11)


def usual(name: str) -> Calibration:
    """Return one of CALIBRATIONS, for a test alone."""
    return Calibration(deepcopy(_fitted(name).document))


@cache
def _fitted(name: str) -> Calibration:
    return CALIBRATIONS[name]()


def _fog() -> Calibration:
    rate, warm = grid_11_by_11()
    rng = np.random.default_rng(1)
    u = (warm - 35) / 10
    output = rate + 0.2 + 0.05 * u + rate * (0.01 + 0.003 * u) - 4e-7 * rate**3 + rng.normal(0, 1e-3, 121)
    return calibrated(points(rate, warm, output), "ojeda2000")


def _mems() -> Calibration:
    return calibrated(Triaxial(2).campaign(2), "yang2018")


def _plain() -> Calibration:
    rate, warm = grid_11_by_11()
    output = rate * (1.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
    return calibrated(points(rate, warm, output), "bias_scale")


def _open_loop() -> Calibration:
    rate, warm = 3 * grid_11_by_11()[0], grid_11_by_11()[1]
    optical = np.rad2deg(np.sin(0.12 * np.deg2rad(rate)) / 0.12)
    output = optical + rate * (0.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
    return calibrated(points(rate, warm, output), "bias_scale", ["sine_response"])


def _open_loops() -> Calibration:
    recording = Triaxial(2).campaign(2)
    columns = dict(recording.columns)
    for axis, k in zip("xyz", (0.02, 0.05, 0.1), strict=True):
        own = np.where(columns["position"] == axis, columns["table_rate_dps"], 0.0)
        columns[f"gyro_{axis}"] = columns[f"gyro_{axis}"] + np.rad2deg(np.sin(k * np.deg2rad(own)) / k) - own
    return calibrated(replace(recording, columns=columns), "yang2018", ["sine_response"])


CALIBRATIONS: dict[str, Callable[[], Calibration]] = {
    "fog": _fog, "mems": _mems, "plain": _plain, "open_loop": _open_loop, "open_loops": _open_loops,
}  # fmt: skip
