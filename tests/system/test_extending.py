"""Packages outside the project, made from the how-to alone, installed by pip, and used by the command line."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.helpers.extending_page import PAGE, commands_of, files_of, sections, write_files
from tests.helpers.forked_commands import run_labctl
from tests.helpers.paths import EXAMPLES, ROOT

GYRO, EFFECT, EXPORT, _EXPERIMENT, IMPORTER, RECIPE = sections()
PACKAGES = {GYRO: "acme-gyro", EFFECT: "acme-humidity", EXPORT: "acme-table", IMPORTER: "acme-log"}
PIP = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-index"]


#: An export that fails at what it does, not at its import.
BROKEN_EXPORT = """
from labctl.exports.format import Format
FORMAT = Format("Broken", "text/csv", "csv", lambda calibration: {}["x"])
"""


class Outside:
    """A folder of a user's: the files of one section, its package installed, a database of its own."""

    def __init__(self, folder: Path, section: str, kept: Path, installed: dict[str, Path]) -> None:
        """`installed` are the packages that pip has installed for all tests, each kept in a folder of `kept`."""
        self.folder, self.site, self.kept, self.installed = folder, folder / "site", kept, installed
        self.section = sections()[section]
        write_files(self.section, folder)

    def install(self, package: str) -> None:
        """Install a package of this folder by pip, as the how-to does, into a folder of its own.

        What pip has installed for another test, from the same files of the page, is copied.
        """
        if package not in self.installed:
            options = ["--no-build-isolation", "--no-deps", "--target", str(self.site)]
            subprocess.run([*PIP, *options, f"./{package}"], cwd=self.folder, check=True, capture_output=True)
            self.installed[package] = Path(shutil.copytree(self.site, self.kept / package))
        shutil.copytree(self.installed[package], self.site, dirs_exist_ok=True)

    def labctl(self, line: str, status: int = 0) -> subprocess.CompletedProcess[str]:
        """Run a command line of labctl in this folder; it must end with this exit status."""
        found = os.environ.get("PYTHONPATH", "")
        path = os.pathsep.join(filter(None, [str(self.site), str(ROOT), found]))
        environment = {**os.environ, "PYTHONPATH": path, "LABCTL_DATABASE": str(self.folder / "lab.sqlite")}
        done = run_labctl(line.split()[1:], folder=self.folder, environment=environment)
        assert done.returncode == status, done.stdout + done.stderr
        return done

    def follow(self) -> dict[str, str]:
        """Do what the section says, line by line; returns what each labctl line printed."""
        printed = {}
        for line in commands_of(self.section):
            if line.startswith("labctl"):
                printed[line] = self.labctl(line).stdout
            else:
                self.install(line.rpartition("./")[2])
        return printed

    def json(self, line: str, status: int = 0) -> Any:
        """Return what a command line prints with --json."""
        return json.loads(self.labctl(f"{line} --json", status).stdout)


@pytest.fixture(scope="module")
def installed() -> dict[str, Path]:
    return {}


@pytest.fixture
def outside(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, installed: dict[str, Path]
) -> Callable[[str], Outside]:
    return lambda section: Outside(tmp_path, section, tmp_path_factory.mktemp("kept"), installed)


def test_the_examples_are_what_the_page_says() -> None:
    given = files_of(PAGE.read_text(encoding="utf-8"))
    folder = EXAMPLES / "plugins"
    there = {
        str(path.relative_to(folder)): path.read_text(encoding="utf-8")
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert there == given


@pytest.mark.slow
def test_a_driver_with_its_simulator(outside: Callable[[str], Outside]) -> None:
    user = outside(GYRO)
    refused = user.labctl("labctl bench check acme-gyro/bench.toml", status=2)
    assert refused.stderr.count("\n") == 1
    assert "gyros.0.driver: no driver 'acme-g1' is installed (installed: can (labctl " in refused.stderr
    printed = user.follow()
    assert "[acme-g1 of acme-gyro 0.1.0]" in printed["labctl bench check acme-gyro/bench.toml"]
    tried = printed["labctl driver test acme-g1"].splitlines()
    assert tried[-1] == "acme-g1 of acme-gyro 0.1.0: all 11 checks passed"
    bench = user.folder / "acme-gyro" / "bench.toml"
    whole = bench.read_text("utf-8")
    bench.write_text(whole.replace('profile = "rd2100"', ""), encoding="utf-8")
    nameless = user.labctl("labctl bench check acme-gyro/bench.toml", status=2).stderr
    assert nameless.count("\n") == 1
    assert "has no profile of a simulated unit; set one in [simulation.units] of the bench file" in nameless
    bench.write_text(whole.replace('name = "g1"', 'name = "g1"\nmirored = true'), encoding="utf-8")
    misspelt = user.labctl("labctl bench check acme-gyro/bench.toml", status=2).stderr
    assert "gyros.0.mirored: driver acme-g1 has no such setting; choose one of driver, port, " in misspelt
    campaign = user.json("labctl campaign status")
    assert campaign["state"] == "done"
    assert campaign["drivers"]["g1"] == {"driver": "acme-g1", "distribution": "acme-gyro", "version": "0.1.0"}
    assert campaign["drivers"]["table"]["distribution"] == "labctl"
    (started,) = [entry for entry in user.json("labctl audit list") if entry["action"] == "campaign start"]
    assert started["detail"]["drivers"]["g1"]["version"] == "0.1.0"
    fitted = user.json("labctl fit G1-0001 --effects bias,scale_factor")
    assert fitted["axes"]["z"]["coefficients"]["scale_factor"]["value"] == pytest.approx(0.024, abs=0.02)
    assert fitted["error"]["rms_dps"] < 0.2 * fitted["error"]["raw_rms_dps"]


@pytest.mark.slow
def test_an_effect_on_both_sides(outside: Callable[[str], Outside]) -> None:
    user = outside(EFFECT)
    printed = user.follow()
    assert "humidity_sensitivity" in printed["labctl effects"]
    (about,) = [e for e in user.json("labctl effects")["effects"] if e["id"] == "humidity_sensitivity"]
    assert (about["unit"], about["needs"]) == ("deg/s/%", ["humidity_pct"])
    found = user.json("labctl criticise FOG-0001 --version 1")
    assert found["named"] == ["humidity_sensitivity"]
    improved = user.json("labctl improve FOG-0001 --version 1 --add humidity_sensitivity")
    assert improved["axes"]["z"]["coefficients"]["humidity"]["value"] == pytest.approx(0.02, rel=0.1)
    assert improved["error"]["rms_dps"] < 0.5 * improved["before"]["rms_dps"]


@pytest.mark.slow
def test_an_export(outside: Callable[[str], Outside]) -> None:
    user = outside(EXPORT)
    user.follow()
    table = (user.folder / "fog.csv").read_text("utf-8").splitlines()
    assert table[0] == "axis,output_dps,temperature_c,error_dps"
    assert len(table) == 1 + 21 * 11
    formula = user.labctl("labctl fit FOG-0001 --effects bias,supply_sensitivity --accept-warnings")
    assert formula.returncode == 0
    refused = user.labctl("labctl calibration FOG-0001 --version 2 --format lookup-csv", status=2).stderr
    assert "format lookup-csv: the model needs supply_v too; use json" in refused
    unknown = user.labctl("labctl calibration FOG-0001 --version 1 --format lookup", status=2).stderr
    assert "no export format 'lookup' is installed (installed: ardupilot (labctl " in unknown
    assert "did you mean 'lookup-csv'?" in unknown
    (user.site / "acme_table" / "export.py").write_text(BROKEN_EXPORT, encoding="utf-8")
    failed = user.labctl("labctl calibration FOG-0001 --version 1 --format lookup-csv", status=2).stderr
    assert "of acme-table 0.1.0 in group labctl.exports: cannot write this calibration: KeyError: 'x'" in failed


@pytest.mark.slow
def test_an_importer(outside: Callable[[str], Outside], tmp_path: Path) -> None:
    user = outside(IMPORTER)
    user.follow()
    recordings = [user.json(f"labctl export recording {number} --out out{number} --csv") for number in (1, 2)]
    heads = [(user.folder / each["folder"] / "recording.toml").read_text("utf-8") for each in recordings]
    assert 'serial = "ACME-7"' in heads[0]
    assert 'serial = "ACME-8"' in heads[1]
    assert "read from flight.log by importer acme-log of acme-log 0.1.0" in heads[0]
    rows = (tmp_path / "out1" / "samples.csv").read_text("utf-8").splitlines()
    assert len(rows) == 7
    assert user.json("labctl fit ACME-7 --effects bias,scale_factor --accept-warnings")["version"] == 1
    assert user.json("labctl audit verify")["ok"]


def test_a_wrong_line_and_a_wrong_option_of_an_importer_are_named(outside: Callable[[str], Outside]) -> None:
    user = outside(IMPORTER)
    log = user.folder / "acme-log" / "flight.log"
    refused = user.labctl("labctl import acme-log/flight.log", status=2).stderr
    assert "flight.log: the unit moves in 100 % of the time" in refused  # taken for a text of free motion
    user.install("acme-log")
    wrong = user.labctl("labctl import acme-log/flight.log --option seral=A", status=2).stderr
    assert "importer acme-log: option seral: Extra inputs are not permitted (its options are serial)" in wrong
    unknown = user.labctl("labctl import acme-log/flight.log --format acme-lag", status=2).stderr
    assert "no importer 'acme-lag' is installed" in unknown
    assert "did you mean 'acme-log'?" in unknown
    log.write_text(log.read_text("utf-8").replace("3;2,1;", "3;1,1;"), encoding="utf-8")
    back = user.labctl("labctl import acme-log/flight.log", status=2).stderr
    assert "flight.log: column 't_s', row 6: 1.1 s does not follow 2 s" in back
    log.write_text(log.read_text("utf-8").replace("25,1;", "warm;"), encoding="utf-8")
    assert "flight.log: line 8: could not convert" in user.labctl("labctl import acme-log/flight.log", status=2).stderr


def test_a_recipe_of_ones_own(outside: Callable[[str], Outside]) -> None:
    printed = outside(RECIPE).follow()
    assert all("rest-and-turns" in text for text in printed.values())


def test_a_package_that_fails_takes_nothing_else_down(outside: Callable[[str], Outside]) -> None:
    user = outside(GYRO)
    user.install("acme-gyro")
    (user.site / "acme_gyro" / "driver.py").write_text("import no_such_module\n", encoding="utf-8")
    line = (
        "entry point 'acme-g1' (acme_gyro.driver:DRIVER) of acme-gyro 0.1.0 in group labctl.drivers: cannot load this "
        "driver: ModuleNotFoundError: No module named 'no_such_module'; repair or uninstall acme-gyro"
    )
    asked = user.labctl("labctl bench check acme-gyro/bench.toml", status=2)
    assert asked.stderr.count("\n") == 1
    assert line in asked.stderr
    listed = user.labctl("labctl plugins", status=1)
    assert line in listed.stderr
    other = user.labctl("labctl bench check single-axis-sim")
    assert (other.stdout.count("answers"), other.stderr) == (3, "")
    assert len(user.json("labctl effects")["effects"]) > 30
