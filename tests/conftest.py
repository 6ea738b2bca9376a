"""For all tests: small matrices are solved fastest by one thread, and two workers must not fight for two cores."""

import os
import shutil

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what this machine cannot do, and say so."""
    if shutil.which("cc") is not None:
        return
    for item in items:
        if item.get_closest_marker("needs_cc"):
            item.add_marker(pytest.mark.skip(reason="no C compiler (on Debian: apt-get install gcc libc6-dev)"))
