"""A database moved from a file to a server and back: every row the same, and a move that was interrupted goes on."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from typer.testing import CliRunner

from labctl.answers.campaigns import StartRequest
from labctl.cli.app import app
from labctl.errors import BadInput, Conflict, OldSchema, StoreError
from labctl.services.campaigns.execution import run_here
from labctl.store import check, open_store
from labctl.store.connection.database import Database
from labctl.store.integrity import move
from labctl.store.integrity.move import move_database
from labctl.store.schema import tables
from studies.postgresql_cluster import Cluster

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a campaign, and rows whose values are easily changed on the way."""
    path = tmp_path_factory.mktemp("move") / "lab.sqlite"
    assert run_here(str(path), StartRequest(recipe="short", bench="single-axis-sim")).state == "done"
    with open_store(str(path), write=True) as store:
        store.audit.record(
            AT, "noted", "ß Ünit €", {"big": 10**17 + 1, "small": 5e-324, "text": "\t\"'\\", "none": None}
        )
        for name in ("b", "B", "a_", "a-", "Ä"):  # texts are ordered by their bytes in a file, by language on a server
            with store._database.writing() as connection:
                connection.execute(sa.insert(tables.units).values(serial=name, model="m", first_seen_at=AT))
    return path


@pytest.fixture
def source(measured: Path, tmp_path: Path) -> str:
    path = tmp_path / "source.sqlite"
    with closing(sqlite3.connect(measured)) as old, closing(sqlite3.connect(path)) as new:
        old.backup(new)
    return str(path)


def raw(path: str) -> dict[str, list[Any]]:
    """Return every stored value of every table of a file, as Python's own driver reads it."""
    with closing(sqlite3.connect(path)) as connection:
        return {
            table.name: connection.execute(f"SELECT * FROM {table.name} ORDER BY 1, 2, 3").fetchall()
            for table in tables.metadata.sorted_tables
            if len(table.columns) > 2
        }


def test_there_and_back_every_stored_value_is_the_same(source: str, url: str, tmp_path: Path) -> None:
    there = move_database(source, url)
    back = str(tmp_path / "back.sqlite")
    home = move_database(url, back)
    assert (there.rows, there.sha256, there.kept) == (home.rows, home.sha256, 0)
    assert there.rows > 100
    assert raw(back) == raw(source)
    assert check(url).findings == check(back).findings == ()


@pytest.mark.slow
def test_the_server_counts_on_from_the_highest_number(source: str, url: str) -> None:
    move_database(source, url)
    with open_store(url, write=True) as store:
        before = [row.id for row in store.audit.rows()]
        store.audit.record(AT, "noted", "after the move", {})
        assert [row.id for row in store.audit.rows()] == [*before, max(before) + 1]
        assert store.audit.first_broken() is None
    assert run_here(url, StartRequest(recipe="short", bench="single-axis-sim")).id == 2


@pytest.mark.slow
def test_an_interrupted_move_goes_on_and_nothing_opens_its_target(
    source: str, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(move, "ROWS", 7)
    monkeypatch.setattr(move, "READINGS_ROWS", 2)

    def cut(table: str, done: int, total: int) -> None:
        if table == "sample_blocks" and done >= total // 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        move_database(source, url, cut)
    with pytest.raises(StoreError, match="`labctl move-database` into this database has not ended; run it again"):
        Database(url, write=True)
    assert "move-database" in check(url).findings[0].text
    moved = move_database(source, url)
    assert 0 < moved.kept < moved.rows
    assert check(url).findings == ()


@pytest.mark.parametrize(
    "change", ["UPDATE units SET model = 'other' WHERE serial = 'b'", "DELETE FROM units WHERE serial = 'b'"]
)
def test_a_source_that_was_used_meanwhile_is_noticed(source: str, url: str, change: str) -> None:
    def cut(table: str, _done: int, _total: int) -> None:
        if table == "campaigns":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        move_database(source, url, cut)
    with closing(sqlite3.connect(source)) as connection:
        connection.execute(change)
        connection.commit()
    with pytest.raises(StoreError, match=r"table units: .* empty the target and move again"):
        move_database(source, url)


def test_databases_that_cannot_be_moved_are_named(source: str, url: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there is no such file"):
        move_database(str(tmp_path / "none.sqlite"), url)
    with pytest.raises(BadInput, match="cannot be moved to itself"):
        move_database(source, source)
    with pytest.raises(BadInput, match="the folder does not exist"):
        move_database(source, str(tmp_path / "no" / "lab.sqlite"))
    with pytest.raises(BadInput, match="has the tables of labctl already"):
        move_database(source, _full(tmp_path))
    with open_store(source, write=True), pytest.raises(Conflict):
        move_database(source, url)
    lease = {"bench_name": "b", "owner": "o", "host": "lab7", "machine": "m", "pid": 42, "since": AT, "beat": 1}
    with open_store(source, write=True) as store, store._database.writing() as connection:
        connection.execute(sa.insert(tables.leases).values(**lease, beat_at=AT, expires_at=AT))
    with pytest.raises(Conflict, match="process 42 on lab7 holds bench b; end its service"):
        move_database(source, url)
    with closing(sqlite3.connect(source)) as connection:
        connection.execute("UPDATE alembic_version SET version_num = '0024'")
        connection.commit()
    with pytest.raises(OldSchema, match="run `labctl migrate"):
        move_database(source, url)
    with closing(Database(url, write=True, as_it_is=True)) as target:
        assert target.revision() is None  # no target was begun


def _full(folder: Path) -> str:
    location = str(folder / "full.sqlite")
    Database(location, write=True).close()
    return location


def test_the_command_checks_the_target_and_enters_the_move(source: str, url: str) -> None:
    done = CliRunner().invoke(app, ["move-database", source, url, "--json"])
    assert done.exit_code == 0, done.output
    answer = json.loads(done.stdout)
    assert answer["check"]["ok"]
    with open_store(url, write=False) as store:
        last = store.audit.rows()[-1]
    assert (last.action, last.detail["rows"], last.detail["sha256"]) == (
        "database move",
        answer["rows"],
        answer["sha256"],
    )


@pytest.mark.slow
def test_a_backup_of_a_server_is_one_file_of_one_instant_and_is_moved_back(
    source: str, cluster: Cluster, url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    move_database(source, url)
    lease = {"bench_name": "b", "owner": "o", "host": "lab7", "machine": "m", "pid": 42, "since": AT, "beat": 1}
    with open_store(url, write=True) as store:
        with store._database.writing() as connection:
            connection.execute(sa.insert(tables.leases).values(**lease, beat_at=AT, expires_at=AT))
        bring = move._Move.bring

        def beside_a_writer(moved: Any, table: sa.Table) -> None:
            store.audit.record(AT, "noted", "while the backup is made", {})
            bring(moved, table)

        monkeypatch.setattr(move._Move, "bring", beside_a_writer)
        done = CliRunner().invoke(app, ["backup", str(tmp_path / "copy.sqlite"), "--database", url, "--json"])
        monkeypatch.undo()
    answer = json.loads(done.stdout)
    assert (answer["findings"], answer["noted"]) == ([], True)
    assert [path.name for path in tmp_path.glob("copy*")] == ["copy.sqlite"]
    assert not list(tmp_path.glob(".labctl-backup-*"))
    before, copied = raw(source), raw(str(tmp_path / "copy.sqlite"))
    assert copied == before  # nothing of what was written meanwhile, and no lease
    assert move_database(str(tmp_path / "copy.sqlite"), cluster.new_database()).rows > 100
