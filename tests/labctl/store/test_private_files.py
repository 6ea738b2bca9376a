"""Files that labctl makes are their owner's alone, whatever the umask is."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest

from labctl.config import default_database
from labctl.services.cache import FileCache
from labctl.store import copy_database, open_store

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture(params=[0o000, 0o022, 0o077, 0o277])
def umask(request: pytest.FixtureRequest) -> Iterator[int]:
    before = os.umask(request.param)
    yield request.param
    os.umask(before)


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.usefixtures("umask")
def test_a_database_and_its_side_files_are_private(tmp_path: Path) -> None:
    location = tmp_path / "lab.sqlite"
    with open_store(str(location), write=True) as store, open_store(str(location), write=False) as reader:
        store.audit.record(AT, "fit", "unit G-1", {})
        assert reader.audit.rows()
        copy_database(str(location), tmp_path / "copy.sqlite")
        found = {path.name: mode(path) for path in tmp_path.iterdir()}
    names = {f"lab.sqlite{end}" for end in ("", "-wal", "-shm", ".lock", ".holder", ".seal", ".anchor")}
    assert found == dict.fromkeys({*names, "copy.sqlite"}, 0o600)


def test_what_an_earlier_version_left_open_is_closed(tmp_path: Path) -> None:
    location = tmp_path / "lab.sqlite"
    with open_store(str(location), write=True) as store:
        store.audit.record(AT, "fit", "unit G-1", {})
    for path in tmp_path.iterdir():
        path.chmod(0o666)
    with open_store(str(location), write=True) as store:
        store.audit.record(AT, "fit", "unit G-1", {})
        assert {path.name: oct(mode(path)) for path in tmp_path.iterdir() if mode(path) != 0o600} == {}


@pytest.mark.parametrize("mask", [0o000, 0o022])
def test_the_folders_of_the_cache_and_of_the_database(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mask: int
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv("LABCTL_DATABASE", raising=False)
    before = os.umask(mask)
    try:
        cache = FileCache("answers", ".json", most=4)
        cache.save(cache.file({"a": 1}), b"{}")
        folder = Path(default_database()).parent
    finally:
        os.umask(before)
    assert (mode(tmp_path / "cache" / "labctl"), mode(tmp_path / "cache" / "labctl" / "answers")) == (0o700, 0o700)
    assert [mode(path) for path in (tmp_path / "cache" / "labctl" / "answers").iterdir()] == [0o600]
    assert mode(folder) == 0o700
