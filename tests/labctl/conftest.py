"""Recordings made by plain formulas, for tests of the rooms above the bench."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from labctl.recording import Recording
from tests.helpers.recordings import Triaxial, points


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
