"""The database of a study: a file, or with LABCTL_STUDY_POSTGRESQL=1 one on a private PostgreSQL server."""

from __future__ import annotations

import os
from contextlib import ExitStack
from functools import cache
from multiprocessing.util import Finalize
from pathlib import Path

from studies import postgresql_cluster
from studies.postgresql_cluster import Cluster

ON_SERVER = os.environ.get("LABCTL_STUDY_POSTGRESQL", "0") != "0"

#: Ends this process's server with it.
_opened = ExitStack()


@cache
def server() -> Cluster:
    """Return the server of this process, which ends with it, or before it by `close_server`.

    Raises RuntimeError where the machine has no programs of a server.
    """
    programs = postgresql_cluster.programs()
    if programs is None:
        raise RuntimeError("no PostgreSQL server (on Debian: apt-get install postgresql)")
    Finalize(None, close_server, exitpriority=1)  # at the end of a worker of a pool too
    return _opened.enter_context(postgresql_cluster.running_cluster(programs))


def close_server() -> None:
    """End the server of this process, if it has one."""
    _opened.close()
    server.cache_clear()


def new_database(folder: Path) -> str:
    """Return the location of a database that is not there yet, or is empty."""
    return server().new_database() if ON_SERVER else str(folder / "lab.sqlite")
