"""Once a bench is open, a campaign imports and opens nothing more: it ends well in a process without a file left."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.paths import ROOT


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bench", "how", "state"),
    [
        ("single-axis-sim", "done", "done"),
        ("triaxial-sim", "done", "done"),
        ("single-axis-sim", "aborted", "aborted"),
        ("triaxial-sim", "resumed", "done"),
    ],
)
def test_a_campaign_needs_no_further_file(tmp_path: Path, bench: str, how: str, state: str) -> None:
    words = [sys.executable, "-m", "tests.helpers.sealed_campaign", str(tmp_path / "lab.sqlite"), bench, "short", how]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) | {"reason": ""} == {"state": state, "reason": "", "late": []}
