"""A campaign whose process is killed: the next process finishes it. One of the kills of the study."""

from __future__ import annotations

from pathlib import Path

import pytest

from studies import process_kill


@pytest.mark.slow
def test_a_real_process_is_killed_over_pty_and_tcp_and_its_heir_finishes(tmp_path: Path) -> None:
    with process_kill.simulators(tmp_path) as bench:
        heir = process_kill.kill_once(tmp_path, bench, 8.0)
    assert heir.well, heir
