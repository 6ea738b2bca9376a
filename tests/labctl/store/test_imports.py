"""An import is a sequence of short transactions: others get their turn, and what is not whole is not seen."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from alembic import command

from labctl.errors import BadRecording, Conflict, NotFound
from labctl.recording import Recording, data_set_limits, to_points
from labctl.store import Imports, Store, check, import_parts, migrate, migrate_database, open_store
from labctl.store.connection.database import Database
from tests.helpers.one_row_sets import AT, one_row_sets
from tests.helpers.patience import WAIT_S

#: What may come in one transaction beside the rows of its part: the sign of life, the audit row and its head.
BESIDE = 5


class Transactions:
    """Counts the rows and the bytes of blocks that each transaction of a database writes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, store: Store) -> None:
        self.rows: list[int] = []
        self.bytes: list[int] = []
        real = Database.writing

        @contextmanager
        def writing(database: Database, *, synced: bool = True) -> Iterator[sa.Connection]:
            with real(database, synced=synced) as connection:
                self.rows.append(0)
                self.bytes.append(0)
                yield connection

        monkeypatch.setattr(Database, "writing", writing)
        sa.event.listen(store.audit._database._engine, "after_cursor_execute", self._count)

    def _count(self, _c: Any, cursor: Any, statement: str, parameters: Any, _x: Any, many: bool) -> None:
        if statement.split(maxsplit=1)[0] in {"INSERT", "DELETE", "UPDATE"}:
            self.rows[-1] += len(parameters) if many else max(cursor.rowcount, 1)
        if statement.startswith("INSERT INTO sample_blocks"):
            rows = parameters if many else [parameters]
            self.bytes[-1] += sum(len(each) for row in rows for each in row if isinstance(each, bytes | memoryview))


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


@pytest.fixture
def store(location: str) -> Iterator[Store]:
    with open_store(location, write=True) as opened:
        yield opened


def rows_of(location: str) -> dict[str, int]:
    """Return how many rows each table has that an import writes to."""
    names = (*import_parts.TABLES, "recordings", "units", "audit")
    with closing(sqlite3.connect(location)) as raw:
        return {name: raw.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in names}


@pytest.mark.slow
def test_another_writer_gets_its_turn_during_an_import(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """20,000 data sets of one reading held the writer for 20 s: 160,000 rows in one transaction."""
    seen = Transactions(monkeypatch, store)
    over = threading.Event()
    between: list[int] = []

    def journal() -> None:
        while not over.is_set():
            before = len(seen.rows)
            store.audit.record(AT, "journal", "campaign 1", {})
            between.append(len(seen.rows) - before - 1)

    other = threading.Thread(target=journal)
    other.start()
    try:
        number = store.recordings.add_import(one_row_sets(20_000), AT)
    finally:
        over.set()
        other.join()
    assert store.recordings.get(number).datasets == 20_000
    assert max(seen.rows) <= import_parts.MAX_ROWS + BESIDE
    assert sum(seen.rows) > 80_000
    assert len(between) > 20
    assert max(between) <= 5  # transactions of the import that came before one of the other's


@pytest.mark.slow
def test_parts_are_bounded_in_bytes(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """A data set of 200,000 readings: its blocks are several, and no transaction has many of them."""
    given = one_row_sets(2, per_set=200_000)
    seen = Transactions(monkeypatch, store)
    number = store.recordings.add_import(given, AT)
    assert sum(seen.bytes) > 3 * import_parts.MAX_BYTES
    assert max(seen.bytes) <= import_parts.MAX_BYTES + import_parts.BLOCK_BYTES
    back = store.recordings.samples(number)
    for name, values in given.columns.items():
        assert np.array_equal(back.columns[name], values), name
    expected, points = to_points(given), store.recordings.points(number)
    assert points.columns["gyro_z"] == pytest.approx(expected.columns["gyro_z"], abs=1e-12)
    found = check(store.location)
    assert (found.findings, found.blocks > 6) == ((), True)
    seen.rows.clear()
    ticket = begun(store, given)
    for part in import_parts.import_parts(ticket.recording, given):
        store.imports.add_part(ticket, part)
    seen.rows.clear()
    store.imports.discard(ticket)
    assert max(seen.rows) <= import_parts.MAX_ROWS + BESIDE
    assert [row.id for row in store.recordings.all()] == [number]


def begun(store: Store, recording: Recording) -> Any:
    return store.imports.begin(recording.info, AT)


def test_a_table_in_several_blocks_comes_back_exactly(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_parts, "BLOCK_BYTES", 1000)
    points = to_points(one_row_sets(50, per_set=4))
    number = store.recordings.add_import(points, AT)
    back = store.recordings.points(number)
    for name, values in points.columns.items():
        assert np.array_equal(back.columns[name], values), name
    assert check(store.location).findings == ()


def test_a_block_of_several_that_was_changed_is_found(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_parts, "BLOCK_BYTES", 1000)
    store.recordings.add_import(one_row_sets(2, per_set=100), AT)
    with closing(sqlite3.connect(store.location)) as raw, raw:
        raw.execute("UPDATE data_set_means SET mean = mean + 1 WHERE number = 2 AND channel = 'gyro_z'")
        raw.execute("DELETE FROM sample_blocks WHERE number = 1 AND seq = 2")
    said = " | ".join(finding.text for finding in check(store.location).findings)
    assert "recording 1 data set 2: the stored mean of gyro_z is" in said
    assert "recording 1 data set 1: blocks before block 3 are missing" in said


class Killed(BaseException):
    """The process ends here: nothing that would come after it is done."""


def killed_import(store: Store, monkeypatch: pytest.MonkeyPatch, at: int) -> None:
    """Import 300 data sets in parts of 100 rows, and end before the transaction of this number."""
    count = [0]
    real = Database.writing

    def writing(database: Database, *, synced: bool = True) -> Any:
        count[0] += 1
        if count[0] > at:
            raise Killed
        return real(database, synced=synced)

    with monkeypatch.context() as patched:
        patched.setattr(import_parts, "MAX_ROWS", 100)
        patched.setattr(Database, "writing", writing)
        with pytest.raises(Killed):
            store.recordings.add_import(one_row_sets(300, "NEW"), AT)


def nothing_seen(location: str) -> None:
    """Look through every reading method for the recording 2 of the unit NEW, which is not whole."""
    with open_store(location, write=False) as reader:
        recordings = reader.recordings
        assert [row.id for row in recordings.all()] == [1]
        assert recordings.of_unit("NEW") == []
        assert [unit.serial for unit in reader.units.all()] == ["G-1"]
        for read in (recordings.get, recordings.points, recordings.samples, recordings.fingerprint):
            with pytest.raises(NotFound):
                read(2)
        with pytest.raises(NotFound):
            recordings.dataset(2, 1)
        with pytest.raises(NotFound, match="is not in this database"):
            reader.units.get("NEW")
        with pytest.raises(NotFound, match="is not in this database"):
            reader.calibrations.document("NEW", None)
        assert (recordings.data_sets(2), recordings.means(2), list(recordings.iter_datasets(2))) == ([], [], [])
        assert [row.subject for row in reader.audit.rows()] == ["recording 1"]
    found = check(location)
    assert (found.findings, found.blocks) == ((), 3)


@pytest.mark.parametrize("at", [1, 2, 5, 12])
def test_a_kill_between_parts_leaves_nothing_that_is_seen(
    location: str, monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    with open_store(location, write=True) as store:
        store.recordings.add_import(one_row_sets(3), AT)
        before = rows_of(location)
        killed_import(store, monkeypatch, at)
        assert rows_of(location)["recordings"] == 2
        nothing_seen(location)
    with open_store(location, write=True) as store:
        assert rows_of(location) == before
        nothing_seen(location)
        assert store.recordings.add_import(one_row_sets(3, "NEW"), AT) == 2
        assert [unit.serial for unit in store.units.all()] == ["G-1", "NEW"]
        assert store.audit.first_broken() is None


def test_what_is_left_is_discarded_in_short_transactions(location: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_store(location, write=True) as store:
        killed_import(store, monkeypatch, 12)
        monkeypatch.setattr("labctl.store.repositories.imports.MAX_ROWS", 100)
        seen = Transactions(monkeypatch, store)
        assert store.imports.discard_unfinished() == 1
        assert store.imports.discard_unfinished() == 0
        assert max(seen.rows) <= 100 + BESIDE
        assert len(seen.rows) > 10
    assert set(rows_of(location).values()) == {0}


@pytest.mark.slow
def test_a_process_that_is_killed_inside_an_import(location: str) -> None:
    """A real process, ended by SIGKILL between two parts."""
    program = """if True:
        import os, signal, sys
        from labctl.store import Imports, import_parts, open_store
        from tests.helpers.one_row_sets import AT, one_row_sets
        import_parts.MAX_ROWS, add_part, parts = 100, Imports.add_part, []
        def dying(imports, ticket, part):
            add_part(imports, ticket, part)
            parts.append(part)
            if len(parts) == 3:
                os.kill(os.getpid(), signal.SIGKILL)
        with open_store(sys.argv[1], write=True) as store:
            store.recordings.add_import(one_row_sets(3), AT)
            Imports.add_part, _ = dying, parts.clear()
            store.recordings.add_import(one_row_sets(300, "NEW"), AT)
    """
    ended = subprocess.run([sys.executable, "-c", program, location], check=False, timeout=WAIT_S)
    assert ended.returncode == -signal.SIGKILL
    assert rows_of(location)["data_sets"] > 50
    nothing_seen(location)
    with open_store(location, write=True):
        assert rows_of(location)["data_sets"] == 3
        assert check(location).findings == ()


def test_an_import_that_was_discarded_cannot_write_into_the_next(store: Store) -> None:
    """Numbers are given again: the one that was begun first must not find its way into the second."""
    recording = one_row_sets(5)
    old = begun(store, recording)
    [part] = import_parts.import_parts(old.recording, recording)
    assert store.imports.discard_unfinished() == 1
    new = begun(store, recording)
    assert new.recording == old.recording
    with pytest.raises(Conflict, match=r"the import was discarded .* import the recording again"):
        store.imports.add_part(old, part)
    with pytest.raises(Conflict):
        store.imports.finish(old, AT, "import", {})
    store.imports.discard(old)
    store.imports.add_part(new, part)
    assert store.imports.finish(new, AT, "import", {}) == new.recording
    with pytest.raises(Conflict):
        store.imports.add_part(new, part)
    assert store.recordings.get(new.recording).datasets == 5


def test_a_failed_import_leaves_a_unit_that_was_known(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.recordings.add_import(one_row_sets(3), AT)
    monkeypatch.setattr(Imports, "finish", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        store.recordings.add_import(one_row_sets(3), AT)
    assert [unit.serial for unit in store.units.all()] == ["G-1"]
    assert [row.id for row in store.recordings.of_unit("G-1")] == [1]


@pytest.mark.parametrize("kind", ["samples", "points"])
def test_too_many_data_sets_are_refused_before_anything_is_written(
    store: Store, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.setattr(data_set_limits, "MAX_DATA_SETS", 100)
    recording = one_row_sets(101)
    before = rows_of(store.location)
    with pytest.raises(BadRecording, match="101 data sets; at most 100 are imported at once; divide the recording"):
        store.recordings.add_import(recording if kind == "samples" else to_points(recording), AT)
    assert rows_of(store.location) == before
    assert store.recordings.add_import(one_row_sets(100), AT) == 1


def test_recordings_of_before_the_mark_are_whole(location: str) -> None:
    """A database that stood at step 0006 is migrated; its recordings are seen."""
    with open_store(location, write=True) as store:
        store.recordings.add_import(one_row_sets(3), AT)
        with store.audit._database.writing() as connection:
            command.downgrade(migrate.configuration(connection), "0006")
            names = {column["name"] for column in sa.inspect(connection).get_columns("recordings")}
            assert names.isdisjoint({"importing", "import_sign_at"})
    migrate_database(location, copy=False)
    with open_store(location, write=True) as migrated:
        assert [row.datasets for row in migrated.recordings.all()] == [3]
