"""What `pip install labctl` brings without the extra `lab` is enough for a robot and a script."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import numpy as np
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from tests.helpers.calibrations import calibrated
from tests.helpers.rest import at_rest

#: Runs first in the other process: modules that the core does not bring are not found there.
ONLY = """
import json, sys
others = set(json.loads(sys.argv[1]))
class Only:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top in others:
            raise ModuleNotFoundError(f"No module named {top!r}", name=top)
sys.meta_path.insert(0, Only())
"""


#: What a file is loaded and rates are corrected without: each takes a robot's program 2 to 60 ms.
NOT_TO_CORRECT = (
    "httpx", "importlib.metadata", "logging", "pydantic", "typing_extensions", "instruments.plugins",
    "labctl.answers.fitted_model", "labctl.fitting.data.rate_profile", "labctl.fitting.effects.families",
    "labctl.fitting.effects.formula", "labctl.fitting.estimation", "labctl.recording.points", "labctl.services",
    "labctl.withdrawal",
)  # fmt: skip


def other_modules() -> list[str]:
    """Return the modules that are installed but brought neither by labctl nor by its dependencies without extras."""
    wanted, found = ["labctl"], {"labctl"}
    while wanted:
        for text in distribution(wanted.pop()).requires or ():
            needed = Requirement(text)
            name = canonicalize_name(needed.name)
            if name not in found and (needed.marker is None or needed.marker.evaluate({"extra": ""})):
                found.add(name)
                wanted.append(name)
    named = packages_distributions().items()
    return [module for module, names in named if not found & {canonicalize_name(name) for name in names}]


def in_core(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a program that has the libraries of the core only."""
    command = [sys.executable, "-c", ONLY + program, json.dumps(other_modules()), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_the_core_brings_numpy_and_three_small_packages() -> None:
    own = [Requirement(text) for text in distribution("labctl").requires or ()]
    names = {needed.name for needed in own if needed.marker is None}
    assert names == {"numpy", "pydantic", "httpx", "httpx-sse"}


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    """Return a calibration that follows a lag."""
    return calibrated(
        at_rest(("z",), lag_s=400.0), effects=["bias", "bias_temperature", "thermal_lag", "thermal_hysteresis"]
    )


@pytest.mark.slow
def test_a_robot_corrects_rates_with_the_core_alone(calibration: Calibration, tmp_path: Path) -> None:
    file = tmp_path / "calibration.json"
    file.write_bytes(calibration.to_bytes())
    warm = 25.0 + 10.0 * np.sin(np.arange(500.0) / 80.0)
    output, t_s = np.random.default_rng(3).normal(0.0, 0.1, (500, 1)), np.arange(500.0) * 7.0
    np.savez(tmp_path / "given.npz", output=output, warm=warm, t_s=t_s)
    done = in_core(
        "import numpy as np\n"
        "from labctl.compensator import Compensator\n"
        "assert 'pydantic' not in sys.modules\n"
        "given = np.load(sys.argv[3])\n"
        "use = Compensator.from_file(sys.argv[2])\n"
        "np.save(sys.argv[4], use.compensate(given['output'], given['warm'], {'t_s': given['t_s']}).rate_dps)\n"
        "loaded = {name for name in sys.argv[5].split() if name in sys.modules}\n"
        "assert not loaded, loaded\n"
        "assert use.calibration.bench is not None\n",
        str(file), str(tmp_path / "given.npz"), str(tmp_path / "rates.npy"), " ".join(NOT_TO_CORRECT),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    here = Compensator(calibration).compensate(output, warm, {"t_s": t_s}).rate_dps
    np.testing.assert_array_equal(np.load(tmp_path / "rates.npy"), here)


@pytest.mark.slow
def test_a_script_has_a_recording_in_memory_and_the_client(tmp_path: Path) -> None:
    done = in_core(
        "import numpy as np\n"
        "from labctl.client import Client\n"
        "from labctl.recording import OutputUnit, Recording, RecordingInfo, to_points\n"
        "given = {'serial': 'A', 'started_at': '2026-01-05T08:00:00Z', 'kind': 'samples', 'axes': ['z']}\n"
        "info = RecordingInfo(**given, output={'z': OutputUnit()})\n"
        "columns = {'dataset': np.repeat([0, 1], 40), 't_s': np.arange(80.0), 'gyro_z': np.arange(80.0),"
        " 'temperature_c': np.full(80, 25.0), 'table_rate_dps': np.repeat([0.0, 9.0], 40),"
        " 'position': np.full(80, '+z')}\n"
        "print(to_points(Recording(info, columns)).columns['gyro_z'].tolist())\n"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [19.5, 59.5]


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("from labctl.fitting import fit", "labctl.fitting.fit needs scipy"),
        ("import runpy; sys.argv = ['labctl', 'units']; runpy.run_module('labctl')", "the command line needs typer"),
    ],
)
def test_what_needs_more_says_which_command_installs_it(program: str, message: str) -> None:
    done = in_core(program)
    assert done.returncode == 1
    assert message in done.stderr
    assert "pip install 'labctl[lab]'" in done.stderr
