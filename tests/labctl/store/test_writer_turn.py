"""A writer waits for the one writing connection for a limited time, and the error names its holder."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from labctl.errors import Conflict, StoreError
from labctl.store import Store, open_store
from labctl.store.connection import database, writer_turn
from labctl.store.connection.database import Database
from labctl.store.repositories.audit import append
from tests.helpers.held_writer import held_writer
from tests.helpers.one_row_sets import AT


def test_a_held_writer_is_named_and_not_waited_for_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer_turn, "WRITER_DEADLINE_S", 0.2)
    monkeypatch.setattr(writer_turn, "OVERDUE_DEADLINE_S", 0.05)
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        said = (
            r"within 0\.2 s; the only connection that writes is in use by .*hold in thread "
            r"'the-holder', for .* s already"
        )
        with held_writer(store) as began:
            began()
            with pytest.raises(StoreError, match=said) as caught:
                store.audit.record(AT, "journal", "campaign 1", {})
            assert "nothing was stored" in str(caught.value)
            with pytest.raises(StoreError, match=r"within 0\.05 s"):
                store.audit.record(AT, "journal", "campaign 1", {})
            assert store.audit.rows() == []  # reading waits for no writer
        store.audit.record(AT, "journal", "campaign 1", {})
        assert len(store.audit.rows()) == 1


def test_a_thread_takes_its_own_turn_again() -> None:
    turn = writer_turn.WriterTurn("lab.sqlite")
    with turn.take():
        with turn.take():
            pass
        assert turn._turn is not None
    assert turn._turn is None


def test_a_database_is_closed_after_the_transaction_that_is_under_way(tmp_path: Path) -> None:
    path = str(tmp_path / "lab.sqlite")
    store = Store(Database(path, write=True))
    begun, go_on, failed = threading.Event(), threading.Event(), list[BaseException]()

    def record() -> None:
        try:
            with store._database.writing() as connection:
                begun.set()
                go_on.wait(20.0)
                append(connection, AT, "journal", "campaign 1", {})
        except BaseException as error:  # noqa: BLE001  compared below
            failed.append(error)

    writer, closer = threading.Thread(target=record), threading.Thread(target=store.close)
    writer.start()
    begun.wait(20.0)
    closer.start()
    closer.join(0.1)
    assert closer.is_alive()
    go_on.set()
    closer.join(20.0)
    writer.join(20.0)
    assert failed == []
    with pytest.raises(StoreError, match=r"lab\.sqlite: the database is closed, because the process that writes it"):
        store.audit.record(AT, "journal", "campaign 2", {})
    store.close()  # again
    with open_store(path, write=True) as successor:
        assert [row.subject for row in successor.audit.rows()] == ["campaign 1"]


def test_what_does_not_end_keeps_its_connection_and_the_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(database, "CLOSED_WITHIN_S", 0.05)
    path = str(tmp_path / "lab.sqlite")
    store = Store(Database(path, write=True))
    with held_writer(store) as began:
        began()
        store.close()
        with pytest.raises(Conflict), open_store(path, write=True):
            pass
    store.close()
    with open_store(path, write=True) as successor:
        assert successor.audit.rows() == []
