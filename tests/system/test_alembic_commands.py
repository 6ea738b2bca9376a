"""What a developer types: `alembic` finds its settings, the database and the tables without an `alembic.ini`."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from labctl.store import migrate
from tests.helpers.paths import ROOT

Alembic = Callable[..., str]


@pytest.fixture
def database(tmp_path: Path) -> Path:
    return tmp_path / "lab.sqlite"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of what Alembic reads: a new revision is not written into the repository."""
    folder = tmp_path / "project"
    shutil.copytree(ROOT / "migrations", folder / "migrations", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


@pytest.fixture
def alembic(project: Path, database: Path) -> Alembic:
    """Run `alembic` in the copy, on a database of its own; returns its output."""

    def run(*arguments: str) -> str:
        command = [sys.executable, "-m", "alembic", *arguments]
        location = os.environ.get("LABCTL_DATABASE") or str(database)
        environment = {**os.environ, "LABCTL_DATABASE": location, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(command, cwd=project, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.mark.slow
def test_a_database_is_upgraded_and_is_then_the_tables_of_the_code(alembic: Alembic, database: Path) -> None:
    alembic("upgrade", "head")
    assert f"{migrate.HEAD} (head)" in alembic("current")
    assert "No new upgrade operations detected" in alembic("check")
    with sqlite3.connect(database) as raw:
        assert list(raw.execute("SELECT version_num FROM alembic_version")) == [(migrate.HEAD,)]
    raw.close()


def test_a_new_revision_has_the_next_number(alembic: Alembic, project: Path) -> None:
    alembic("revision", "-m", "Serial numbers of tables")
    number = f"{int(migrate.HEAD) + 1:04d}"
    text = (project / "migrations" / "versions" / f"{number}_serial_numbers_of_tables.py").read_text(encoding="utf-8")
    assert f'revision = "{number}"\ndown_revision = "{migrate.HEAD}"\n' in text
    assert text.startswith('"""Serial numbers of tables."""\n')


@pytest.mark.slow
def test_a_new_column_is_found(alembic: Alembic, project: Path, database: Path) -> None:
    alembic("upgrade", "head")
    with sqlite3.connect(database) as raw:
        raw.execute("ALTER TABLE units DROP COLUMN first_seen_at")
    raw.close()
    alembic("revision", "--autogenerate", "-m", "First seen")
    (made,) = (project / "migrations" / "versions").glob("*_first_seen.py")
    assert 'sa.Column("first_seen_at", sa.BigInteger(), nullable=False)' in made.read_text(encoding="utf-8")


@pytest.mark.parametrize("url", ["", "postgresql+psycopg://nobody@localhost/none"])
def test_revisions_are_written_as_sql_without_a_database(
    alembic: Alembic, database: Path, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LABCTL_DATABASE", url)
    text = alembic("upgrade", "head", "--sql")
    assert "CREATE TABLE sample_blocks" in text
    assert not database.exists()
