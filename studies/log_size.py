"""Bytes of log per 24 h of bench time: recipe table1-x-table2 (49 h) in virtual time, JSON lines at INFO.

Environment: LABCTL_STUDY_LOG_RECIPE, another recipe that ships with labctl.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

RECIPE = "table1-x-table2"
BENCH = "triaxial-sim"
DAY_S = 86_400.0
LIMIT_BYTES = 10_000_000


def run() -> dict[str, float]:
    """Run the campaign and return the size of its log; about 3 min for the default recipe."""
    recipe = os.environ.get("LABCTL_STUDY_LOG_RECIPE", RECIPE)
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "labctl", "campaign", "start", recipe, "--bench", BENCH, "--seed", "16",
             "--database", str(Path(folder) / "lab.sqlite")],
            env={**os.environ, "LABCTL_LOG_LEVEL": "info"}, check=True,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
    records = [json.loads(line) for line in done.stderr.splitlines()]
    bench_s = max(record.get("t_s", 0.0) for record in records)
    return {
        "bench_time_h": bench_s / 3600.0,
        "records": len(records),
        "bytes": len(done.stderr),
        "bytes_per_24_h": len(done.stderr) / bench_s * DAY_S,
        "limit_bytes_per_24_h": LIMIT_BYTES,
    }
