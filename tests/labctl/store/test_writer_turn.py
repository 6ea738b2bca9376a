"""A writer waits for the one writing connection for a limited time, and the error names its holder."""

from __future__ import annotations

from pathlib import Path

import pytest

from labctl.errors import StoreError
from labctl.store import open_store
from labctl.store.connection import writer_turn
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
