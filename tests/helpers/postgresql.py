"""A PostgreSQL server of the tests' own, where the machine has its programs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from studies import postgresql_cluster
from studies.postgresql_cluster import Cluster


@contextmanager
def running_cluster() -> Iterator[Cluster]:
    """Run a private cluster for the block. Skips the test where there is no server to run."""
    programs = postgresql_cluster.programs()
    if programs is None:
        pytest.skip("no PostgreSQL server (on Debian: apt-get install postgresql)")
    with postgresql_cluster.running_cluster(programs) as cluster:
        yield cluster
