"""`labctl criticise` as a whole command, start-up included: whole catalogue, first time and again."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.machine import describe
from labctl.answers.campaigns import StartRequest
from labctl.services.campaigns.execution import run_here

#: Limits that the project has set itself, on two free cores.
LIMITS = {"triaxial_first_s": 5.0, "triaxial_again_s": 2.0, "single_axis_first_s": 2.0, "memory_gib": 2.0}
LABCTL = (sys.executable, "-m", "labctl")
#: Runs of which the shortest counts: whatever else the machine does only adds to them.
RUNS = 3
#: An effect that is missing from the model, so that suspects are fitted and the search goes on beside it.
HIDDEN = "scale_factor_odd=3e-9"


def run() -> dict[str, float | str]:
    """Measure campaigns, and a simulated recording with an effect hidden; returns seconds and memory."""
    figures: dict[str, float] = {}
    for name, recipe, model in (
        ("triaxial", "table1-x-table2", "yang2018"),
        ("single_axis", "ojeda2000-121", "ojeda2000"),
    ):
        with tempfile.TemporaryDirectory() as folder:
            location = str(Path(folder) / "lab.sqlite")
            serial = next(iter(run_here(location, StartRequest(recipe=recipe)).recordings))
            figures |= _measured(name, folder, location, serial, model)
    with tempfile.TemporaryDirectory() as folder:
        location, recorded = str(Path(folder) / "lab.sqlite"), str(Path(folder) / "in")
        _command(folder, "simulate", "table1-x-table2", "--out", recorded, "--hide", HIDDEN, "--seed", "1")
        serial = json.loads(_command(folder, "import", recorded, "--json", "--database", location)[1])["serial"]
        figures |= _measured("triaxial_hidden", folder, location, serial, "yang2018")
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 2**20
    return {**describe("numpy", "scipy", "sqlalchemy"), **figures, "memory_gib": peak}


def _measured(name: str, folder: str, location: str, serial: str, model: str) -> dict[str, float]:
    """Return what a first criticism after a fit takes, and the same asked again, s."""
    _command(folder, "fit", serial, "--model", model, "--database", location)
    cache, as_fitted = _cache(folder), Path(folder) / "as_fitted"
    shutil.copytree(cache, as_fitted)
    ask = ("criticise", serial, "--database", location)
    again = first = float("inf")
    for _ in range(RUNS):
        shutil.rmtree(cache)
        shutil.copytree(as_fitted, cache)
        first = min(first, _command(folder, *ask)[0])
        again = min(again, _command(folder, *ask)[0])
    return {f"{name}_first_s": first, f"{name}_again_s": again}


def _cache(folder: str) -> Path:
    return Path(folder) / "cache"


def _command(folder: str, *words: str) -> tuple[float, str]:
    """Run a command with a cache of its own; returns what it took, s, and what it printed."""
    begun = time.perf_counter()
    environment = {**os.environ, "XDG_CACHE_HOME": str(_cache(folder))}
    ran = subprocess.run([*LABCTL, *words], check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return time.perf_counter() - begun, ran.stdout
