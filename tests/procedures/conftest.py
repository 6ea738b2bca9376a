"""Fixtures of the procedures: fake benches in virtual time."""

from __future__ import annotations

import pytest

from procedures.planning.limits import BenchLimits
from tests.helpers.engine_rig import Rig


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def two_units() -> Rig:
    return Rig(("imu", "fog"))


@pytest.fixture
def limits() -> BenchLimits:
    return Rig.limits
