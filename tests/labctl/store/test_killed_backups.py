"""Backups that are killed in the middle: the next one into the folder removes what they left, and nothing else."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from labctl.store.integrity.migration import COPY, PREFIX, copy_database
from tests.helpers.processes import first_line, kill

#: A backup that stands still once its copy is made, before it has its name.
STANDS_STILL = """
import signal, sys
from pathlib import Path
from labctl.store.integrity import backup

def stand_still(path):
    print(path, flush=True)
    signal.pause()

backup._synced_digest = stand_still
backup.copy_database(sys.argv[1], Path(sys.argv[2]))
"""


@pytest.fixture
def database(tmp_path: Path) -> str:
    path = tmp_path / "lab.sqlite"
    with closing(sqlite3.connect(path)) as made, made:
        made.execute("CREATE TABLE kept (number INTEGER)")
    return str(path)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "backups"
    made.mkdir()
    return made


@contextmanager
def backup_in_the_middle(database: str, target: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Give the process of a backup that has made its copy, and the path of the copy."""
    words = [sys.executable, "-c", STANDS_STILL, database, str(target)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process, Path(first_line(process).strip())
    finally:
        kill(process)


def temporaries(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"{PREFIX}*"))


def test_the_next_backup_removes_what_a_killed_one_left(database: str, folder: Path) -> None:
    with backup_in_the_middle(database, folder / "monday.sqlite") as (process, copy):
        assert copy.stat().st_size > 0
        kill(process)
    assert temporaries(folder) == [copy.parent]
    Path(f"{copy}-journal").write_bytes(b"SQLite's own")
    copy_database(database, folder / "tuesday.sqlite")
    assert [path.name for path in folder.iterdir()] == ["tuesday.sqlite"]


def test_a_backup_that_still_runs_is_left_alone(database: str, folder: Path) -> None:
    with backup_in_the_middle(database, folder / "monday.sqlite") as (_, copy):
        copy_database(database, folder / "tuesday.sqlite")
        assert temporaries(folder) == [copy.parent]
        assert copy.stat().st_size > 0


def test_what_no_backup_left_stays(database: str, folder: Path) -> None:
    with_notes = folder / f"{PREFIX}notes"
    with_notes.mkdir()
    (with_notes / COPY).write_bytes(b"")
    (with_notes / "notes.txt").write_text("somebody's own")
    within = folder / f"{PREFIX}within"
    (within / COPY).mkdir(parents=True)
    link = folder / f"{PREFIX}link"
    link.symlink_to(with_notes)
    plain = folder / f"{PREFIX}plain"
    plain.write_text("a file")
    hidden = folder / ".tuesday.sqlite-abcd"
    hidden.write_text("another program's")
    before = sorted(folder.rglob("*"))
    copy_database(database, folder / "tuesday.sqlite")
    assert sorted(folder.rglob("*")) == sorted([*before, folder / "tuesday.sqlite"])


def test_a_copy_is_private_whatever_the_umask(database: str, folder: Path) -> None:
    copy_database(database, folder / "tuesday.sqlite")
    assert (folder / "tuesday.sqlite").stat().st_mode & 0o777 == 0o600
