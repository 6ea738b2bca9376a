"""The database that the tests of diagnoses begin with."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.diagnoses import copied, fitted_database


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a database with a unit, its recording and a version."""
    return fitted_database(tmp_path_factory.mktemp("diagnosis"))


@pytest.fixture
def location(fitted: Path, tmp_path: Path) -> str:
    """Return where a copy of it is, for a test alone."""
    return copied(fitted, tmp_path)
