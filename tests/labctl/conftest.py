"""Recordings made by plain formulas, and calibrations of them, for tests of what is above the bench."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.recording import Recording
from tests.helpers import usual_calibrations
from tests.helpers.migrated_databases import migrated_once
from tests.helpers.recordings import Triaxial, points
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.static_recordings import resting
from tests.helpers.usual_calibrations import CALIBRATIONS, Grid, usual


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
def grid_11_by_11() -> Grid:
    """Return rates and temperatures of 121 data sets, temperature by temperature."""
    return usual_calibrations.grid_11_by_11()


@pytest.fixture
def fog() -> Calibration:
    return usual("fog")


@pytest.fixture
def mems() -> Calibration:
    return usual("mems")


@pytest.fixture
def open_loop() -> Calibration:
    return usual("open_loop")


@pytest.fixture
def open_loops() -> Calibration:
    return usual("open_loops")


@pytest.fixture(params=list(CALIBRATIONS))
def any_calibration(request: pytest.FixtureRequest) -> Calibration:
    return usual(request.param)


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
