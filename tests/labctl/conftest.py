"""Recordings made by plain formulas, and calibrations of them, for tests of what is above the bench."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.recording import Recording
from tests.helpers.calibrations import calibrated
from tests.helpers.recordings import Triaxial, points

Grid = tuple[np.ndarray, np.ndarray]


@pytest.fixture
def triaxial() -> Callable[[int], Triaxial]:
    return Triaxial


@pytest.fixture
def make_points() -> Callable[..., Recording]:
    return points


@pytest.fixture
def grid_11_by_11() -> tuple[np.ndarray, np.ndarray]:
    """Return rates and temperatures of 121 data sets, temperature by temperature."""
    rate = np.tile(np.linspace(-100, 100, 11), 11)
    return rate, np.repeat(np.linspace(25, 45, 11), 11)


@pytest.fixture
def fog(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> Calibration:
    rate, warm = grid_11_by_11
    rng = np.random.default_rng(1)
    u = (warm - 35) / 10
    output = rate + 0.2 + 0.05 * u + rate * (0.01 + 0.003 * u) - 4e-7 * rate**3 + rng.normal(0, 1e-3, 121)
    return calibrated(make_points(rate, warm, output), "ojeda2000")


@pytest.fixture
def mems(triaxial: Callable[[int], Any]) -> Calibration:
    return calibrated(triaxial(2).campaign(2), "yang2018")


@pytest.fixture(params=["fog", "mems", "plain"])
def any_calibration(request: pytest.FixtureRequest) -> Calibration:
    if request.param == "plain":
        make, (rate, warm) = request.getfixturevalue("make_points"), request.getfixturevalue("grid_11_by_11")
        output = rate * (1.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
        return calibrated(make(rate, warm, output), "bias_scale")
    found: Calibration = request.getfixturevalue(request.param)
    return found
