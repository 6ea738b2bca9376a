"""What is built and installed carries the migrations: each kind of install creates a database of today's tables."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
import sysconfig
import tarfile
import venv
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from labctl.store import migrate
from labctl.store.schema import tables
from tests.helpers.paths import ROOT

BUILD = "import sys, hatchling.build as hatch; print(getattr(hatch, sys.argv[1])(sys.argv[2]))"
CREATE = """
import json, sys
from labctl.store import migrate, open_store
with open_store(sys.argv[1], write=True):
    print(json.dumps({"folder": str(migrate.FOLDER.resolve()), "head": migrate.HEAD}))
"""


def build(kind: str, source: Path, out: Path) -> Path:
    """Build `wheel`, `sdist` or `editable` from a folder with the hatchling that is installed; returns the file."""
    command = [sys.executable, "-I", "-c", BUILD, f"build_{kind}", str(out)]
    done = subprocess.run(command, cwd=source, capture_output=True, text=True, check=True)
    return out / done.stdout.split()[-1]


def install(wheel: Path, folder: Path) -> Path:
    """Install a wheel into a new environment without network; returns its Python.

    The dependencies are those of the tests: their folder is on the path, without the links that are in it.
    """
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    options = ["install", "--quiet", "--no-deps", "--no-index", "--no-compile", "--disable-pip-version-check"]
    subprocess.run([sys.executable, "-m", "pip", "--python", str(python), *options, str(wheel)], check=True)
    packages = next(folder.glob("lib/python*/site-packages"))
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    return python


def create_database(python: Path, location: Path) -> Any:
    """Create a database by the labctl of an environment; returns where its migrations are and what the last one is."""
    command = [str(python), "-I", "-c", CREATE, str(location)]
    return json.loads(subprocess.run(command, cwd="/", capture_output=True, text=True, check=True).stdout)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return a wheel, a wheel that was built from the source distribution, and an editable one."""
    folder = tmp_path_factory.mktemp("built")
    sdist = build("sdist", ROOT, folder)
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    unpacked = folder / sdist.name.removesuffix(".tar.gz")
    assert list(unpacked.glob("migrations/versions/*.py"))
    out = {kind: folder / kind for kind in ("wheel", "wheel of the sdist", "editable")}
    return {
        "wheel": build("wheel", ROOT, out["wheel"]),
        "wheel of the sdist": build("wheel", unpacked, out["wheel of the sdist"]),
        "editable": build("editable", ROOT, out["editable"]),
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["wheel", "wheel of the sdist", "editable"])
def test_an_installed_labctl_creates_a_database_by_its_own_migrations(
    kind: str, built: dict[str, Path], tmp_path: Path
) -> None:
    python = install(built[kind], tmp_path / "environment")
    used = create_database(python, tmp_path / "lab.sqlite")
    assert used["head"] == migrate.HEAD
    home = ROOT if kind == "editable" else tmp_path / "environment"
    assert Path(used["folder"]).is_relative_to(home)
    with sqlite3.connect(tmp_path / "lab.sqlite") as raw:
        made = {name for (name,) in raw.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        assert list(raw.execute("SELECT version_num FROM alembic_version")) == [(migrate.HEAD,)]
    raw.close()
    assert made >= set(tables.metadata.tables)


@pytest.mark.slow
def test_a_wheel_tells_type_checkers_that_it_has_types(built: dict[str, Path]) -> None:
    with ZipFile(built["wheel"]) as wheel:
        assert {f"{package}/py.typed" for package in ("instruments", "procedures", "labctl")} <= set(wheel.namelist())
