"""A PostgreSQL server of the tests' own: one for each worker, made for the first test that needs it."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from studies import postgresql_cluster
from studies.postgresql_cluster import Cluster

ABSENT = "no PostgreSQL server on this machine: the tests on one are left out (on Debian: apt-get install postgresql)"


def pytest_report_header() -> list[str]:
    """Say in one line that the tests on a server are left out."""
    return [] if postgresql_cluster.programs() is not None else [ABSENT]


@pytest.fixture(scope="session")
def cluster() -> Iterator[Cluster]:
    """A private cluster. Without a server to run, a test is skipped, and in CI it fails.

    A test may stop, crash or freeze it, and leaves it running.
    """
    programs = postgresql_cluster.programs()
    if programs is None and os.environ.get("CI"):
        pytest.fail(ABSENT, pytrace=False)
    if programs is None:
        pytest.skip(ABSENT)
    with postgresql_cluster.running_cluster(programs) as running:
        yield running


@pytest.fixture
def url(cluster: Cluster) -> str:
    """The URL of an empty database on the cluster."""
    return cluster.new_database()
