"""A database that this process may only read: refused here, and by the database itself."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import sqlalchemy as sa
from sqlalchemy import exc

from labctl.errors import ReadOnly, StoreError
from labctl.store import Store, holder_of, open_store
from labctl.store.connection.database import Database
from labctl.store.connection.sqlite_reader import SqliteReader
from studies.postgresql_cluster import Cluster
from tests.helpers.waiting import eventually

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A database with one row of audit, whose writer has ended."""
    path = tmp_path / "lab.sqlite"
    with open_store(str(path), write=True) as store:
        store.audit.record(AT, "noted", "row 1", {})
    return path


@pytest.fixture
def at_rest(file: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same in a folder that this user may not write to."""
    monkeypatch.setattr(os, "access", lambda *_: False)
    return file


def subjects(store: Store) -> list[str]:
    return [row.subject for row in store.audit.rows()]


def refused_by_the_database(location: str) -> str:
    """Return what a database says to a statement that labctl's own refusal did not reach."""
    database = Database(location, write=False, read_only=True)
    try:
        with pytest.raises(exc.DatabaseError) as refused, database._engine.begin() as connection:
            connection.execute(sa.text("DELETE FROM audit"))
        return str(refused.value.orig)
    finally:
        database.close()


def test_a_transaction_is_refused_here_and_by_the_file(file: Path) -> None:
    with open_store(str(file), write=False, read_only=True) as store:
        with pytest.raises(ReadOnly, match="only reads the database, nothing was stored; send the request"):
            store.audit.record(AT, "noted", "row 2", {})
        assert not store.address.can_write
        with store.address.open() as of_a_worker, pytest.raises(ReadOnly):
            of_a_worker.audit.record(AT, "noted", "row 2", {})
        assert subjects(store) == ["row 1"]
    assert refused_by_the_database(str(file)) == "attempt to write a readonly database"


def test_no_file_is_made_where_there_is_none(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="no such file, and a service that only reads makes none; name"):
        Database(str(tmp_path / "absent.sqlite"), write=False, read_only=True)
    (tmp_path / "empty.sqlite").touch()
    with pytest.raises(StoreError, match="has no tables of labctl, and a service that only reads makes none"):
        Database(str(tmp_path / "empty.sqlite"), write=False, read_only=True)
    assert holder_of(str(tmp_path / "empty.sqlite")) is None
    assert [path.name for path in tmp_path.iterdir()] == ["empty.sqlite"]


def test_a_reader_beside_a_writer_sees_what_is_written(file: Path) -> None:
    with open_store(str(file), write=False, read_only=True) as reader, open_store(str(file), write=True) as writer:
        writer.audit.record(AT, "noted", "row 2", {})
        assert subjects(reader) == ["row 1", "row 2"]
        assert reader.is_held
    with open_store(str(file), write=False, read_only=True) as reader:
        assert not reader.is_held


def test_a_file_in_a_folder_that_may_not_be_written_is_read_and_nothing_is_made_there(at_rest: Path) -> None:
    before = sorted(path.name for path in at_rest.parent.iterdir())
    with open_store(str(at_rest), write=False, read_only=True) as reader:
        assert subjects(reader) == ["row 1"]
        assert sorted(path.name for path in at_rest.parent.iterdir()) == before


def test_a_newer_copy_in_its_place_is_read(at_rest: Path, tmp_path: Path) -> None:
    newer = tmp_path / "newer.sqlite"
    shutil.copy(at_rest, newer)
    with open_store(str(at_rest), write=False, read_only=True) as reader:
        assert subjects(reader) == ["row 1"]
        with open_store(str(newer), write=True) as writer:
            writer.audit.record(AT, "noted", "row 2", {})
        newer.replace(at_rest)
        assert subjects(reader) == ["row 1", "row 2"]
        at_rest.unlink()
        with pytest.raises(StoreError, match="the database cannot be read"):
            subjects(reader)


def test_what_changes_while_it_is_read_is_not_believed(at_rest: Path) -> None:
    reader = SqliteReader(str(at_rest))
    with reader.unchanged():
        pass
    with pytest.raises(StoreError, match="was changed while it was read; ask again"), reader.unchanged():
        os.utime(at_rest, ns=(0, 0))


@pytest.mark.slow
def test_the_server_refuses_what_labctl_would_not(url: str) -> None:
    with pytest.raises(StoreError, match="has no tables of labctl"):
        Database(url, write=False, read_only=True)
    with open_store(url, write=True) as writer:
        writer.audit.record(AT, "noted", "row 1", {})
    with open_store(url, write=False, read_only=True) as reader:
        with pytest.raises(ReadOnly):
            reader.audit.record(AT, "noted", "row 2", {})
        assert not reader.address.can_write
        assert reader.replication.state() is None
        assert subjects(reader) == ["row 1"]
    assert "cannot execute DELETE in a read-only transaction" in refused_by_the_database(url)


@pytest.fixture
def replicated(cluster: Cluster, url: str) -> Iterator[tuple[str, Store]]:
    """The address of a database, and its replica, opened for reading only."""
    with open_store(url, write=True):
        pass
    with (
        cluster.replica() as copy,
        open_store(copy.url(sa.make_url(url).database), write=False, read_only=True) as store,
    ):
        yield url, store


@pytest.mark.slow
def test_a_replica_says_how_old_its_data_are(replicated: tuple[str, Store], cluster: Cluster) -> None:
    url, reader = replicated
    with open_store(url, write=True) as writer:
        writer.audit.record(AT, "noted", "row 1", {})
    eventually(lambda: subjects(reader) == ["row 1"])
    state = reader.replication.state()
    assert state is not None
    assert state.is_connected
    assert state.last_change_at is not None
    assert state.age_s is not None
    assert 0 <= state.age_s < 60
    assert abs(datetime.now(UTC) - state.last_change_at - timedelta(seconds=state.age_s)) < timedelta(seconds=10)
    cluster.stop()
    try:
        eventually(lambda: not reader.replication.state().is_connected)  # type: ignore[union-attr]
        later = reader.replication.state()
        assert later is not None
        assert later.last_change_at is not None
        assert later.last_change_at >= state.last_change_at  # the server may have sent what was written last
        assert later.age_s is not None
        assert later.age_s > state.age_s
        assert subjects(reader) == ["row 1"]
    finally:
        cluster.start()
