"""The number of processes that run the tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.helpers.worker_count import EACH_BYTES, available_bytes, worker_count


@pytest.mark.parametrize(
    ("processors", "processes_in_memory", "count"), [(2, 100, 4), (8, 100, 10), (2, 3, 3), (2, 0, 1)]
)
def test_so_many_as_compute_and_wait_at_once_and_as_the_memory_has_room_for(
    processors: int, processes_in_memory: int, count: int
) -> None:
    assert worker_count(processors, processes_in_memory * EACH_BYTES) == count
    assert worker_count(processors, None) == processors + 2


def test_the_memory_that_is_available_is_what_the_system_states(tmp_path: Path) -> None:
    file = tmp_path / "meminfo"
    file.write_text("MemTotal:  8 kB\nMemAvailable:   2048 kB\n", encoding="ascii")
    assert available_bytes(file) == 2048 * 1024
    assert available_bytes(tmp_path / "absent") is None
