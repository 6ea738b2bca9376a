"""Recordings made by plain formulas, and calibrations of them, for tests of what is above the bench."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.recording import Recording
from tests.helpers.calibrations import calibrated
from tests.helpers.migrated_databases import migrated_once
from tests.helpers.recordings import Triaxial, points
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.static_recordings import resting

Grid = tuple[np.ndarray, np.ndarray]


@pytest.fixture(scope="module", autouse=True)
def databases() -> Iterator[None]:
    """Take new databases from one that was migrated."""
    with migrated_once():
        yield


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


@pytest.fixture
def open_loop(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> Calibration:
    rate, warm = 3 * grid_11_by_11[0], grid_11_by_11[1]
    optical = np.rad2deg(np.sin(0.12 * np.deg2rad(rate)) / 0.12)
    output = optical + rate * (0.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
    return calibrated(make_points(rate, warm, output), "bias_scale", ["sine_response"])


@pytest.fixture
def open_loops(triaxial: Callable[[int], Any]) -> Calibration:
    recording = triaxial(2).campaign(2)
    columns = dict(recording.columns)
    for axis, k in zip("xyz", (0.02, 0.05, 0.1), strict=True):
        own = np.where(columns["position"] == axis, columns["table_rate_dps"], 0.0)
        columns[f"gyro_{axis}"] = columns[f"gyro_{axis}"] + np.rad2deg(np.sin(k * np.deg2rad(own)) / k) - own
    return calibrated(replace(recording, columns=columns), "yang2018", ["sine_response"])


@pytest.fixture(params=["fog", "mems", "plain", "open_loop", "open_loops"])
def any_calibration(request: pytest.FixtureRequest) -> Calibration:
    if request.param == "plain":
        make, (rate, warm) = request.getfixturevalue("make_points"), request.getfixturevalue("grid_11_by_11")
        output = rate * (1.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
        return calibrated(make(rate, warm, output), "bias_scale")
    found: Calibration = request.getfixturevalue(request.param)
    return found


@pytest.fixture(scope="module")
def single_axis_run() -> Recording:
    return single_axis(3)


@pytest.fixture
def at_rest() -> Recording:
    """Readings of one axis on a loop of temperature at rest, where the Earth turns."""
    rng = np.random.default_rng(4)
    warm = np.repeat([*range(20, 41, 5), *range(35, 19, -5)], 40) + rng.normal(0, 0.05, 360)
    dataset = np.repeat(np.arange(1, 10), 40)
    moved = {"dataset": dataset, "t_s": np.arange(360.0), "temperature_c": warm}
    recording = resting(0.1 + 0.002 * (warm - 30) + rng.normal(0, 1e-3, 360), **moved)
    return replace(recording, info=recording.info.model_copy(update={"latitude_deg": 48.0}))
