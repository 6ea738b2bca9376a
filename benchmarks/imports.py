"""Processor time to start: imports of what a robot's program uses, and commands, beside the import of numpy alone."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from importlib.metadata import Distribution, distribution
from pathlib import Path
from statistics import median

from packaging.requirements import Requirement

from benchmarks.machine import describe
from tests.helpers.calibrations import calibrated
from tests.helpers.rest import at_rest

RUNS = 9
#: A robot's program: it loads a calibration file and corrects one rate.
CORRECT = """
from labctl.compensator import Compensator
Compensator.from_file("calibration.json").step([1.0], 25.0, 0.0)
"""
PROGRAMS = {
    "numpy": ["-c", "import numpy"],
    "labctl.compensator": ["-c", "import labctl.compensator"],
    "correct one rate": ["-c", CORRECT],
    "labctl.recording": ["-c", "from labctl.recording import Recording, RecordingInfo"],
    "labctl.client": ["-c", "import labctl.client"],
    "labctl --help": ["-m", "labctl", "--help"],
    "labctl units": ["-m", "labctl", "units", "--database", "lab.sqlite"],
}


def run() -> dict[str, float | str]:
    """Return seconds of processor time of each, the median of runs in turns, and MB that the core and `lab` install."""
    found: dict[str, list[float]] = {name: [] for name in PROGRAMS}
    with tempfile.TemporaryDirectory() as folder:
        calibration = calibrated(at_rest(("z",), lag_s=400.0), effects=["bias", "bias_temperature", "thermal_lag"])
        (Path(folder) / "calibration.json").write_bytes(calibration.to_bytes())
        for _ in range(RUNS):
            for name, arguments in PROGRAMS.items():
                found[name].append(_processor_s(arguments, Path(folder)))
    seconds = {f"{name} s": median(times) for name, times in found.items()}
    return {
        **describe("numpy", "pydantic", "httpx"),
        **seconds,
        "numpy alone MB": _megabytes({"numpy"}),
        "core MB": _megabytes(_closure("labctl", "")),
        "lab MB": _megabytes(_closure("labctl", "lab")),
    }


def _processor_s(arguments: list[str], folder: Path) -> float:
    # modules that changed would else be compiled in each run
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _closure(name: str, extra: str) -> set[str]:
    """Return a distribution and all that it needs with an extra."""
    found, wanted = {name}, [(name, extra)]
    while wanted:
        of, own = wanted.pop()
        for text in distribution(of).requires or ():
            needed = Requirement(text)
            if needed.name not in found and (needed.marker is None or needed.marker.evaluate({"extra": own})):
                found.add(needed.name)
                wanted.append((needed.name, ",".join(needed.extras)))
    return found


def _megabytes(names: set[str]) -> float:
    return sum(_size(distribution(name)) for name in names) / 1e6


def _size(of: Distribution) -> int:
    files = [Path(str(of.locate_file(file))) for file in of.files or ()]
    return sum(file.stat().st_size for file in files if file.is_file())
