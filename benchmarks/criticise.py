"""`labctl criticise` as a whole command, start-up included: whole catalogue, first time and again."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.machine import describe
from labctl.services.campaigns.execution import run_here
from labctl.services.schemas.campaigns import StartRequest

#: Limits that the project has set itself.
LIMITS = {"triaxial_first_s": 20.0, "triaxial_again_s": 2.0, "single_axis_first_s": 2.0, "memory_gib": 2.0}
LABCTL = (sys.executable, "-m", "labctl")


def run() -> dict[str, float | str]:
    """Measure one campaign of each kind; returns seconds and memory."""
    figures: dict[str, float] = {}
    for name, recipe, model in (
        ("triaxial", "table1-x-table2", "yang2018"),
        ("single_axis", "ojeda2000-121", "ojeda2000"),
    ):
        with tempfile.TemporaryDirectory() as folder:
            location = str(Path(folder) / "lab.sqlite")
            serial = next(iter(run_here(location, StartRequest(recipe=recipe)).recordings))
            _command(folder, "fit", serial, "--model", model, "--database", location)
            for when in ("first", "again"):
                figures[f"{name}_{when}_s"] = _command(folder, "criticise", serial, "--database", location)
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    return {**describe("numpy", "scipy", "sqlalchemy"), **figures, "memory_gib": peak}


def _command(folder: str, *words: str) -> float:
    """Run a command with a cache of its own; returns what it took, s."""
    begun = time.perf_counter()
    subprocess.run(
        [*LABCTL, *words], check=True, stdout=subprocess.DEVNULL, env={**os.environ, "XDG_CACHE_HOME": folder}
    )
    return time.perf_counter() - begun
