"""A database that is deleted or replaced below a running process is not written to, and the bench is left safe."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError
from typer.testing import CliRunner

from instruments.clock import VirtualClock
from labctl.answers.campaigns import StartRequest
from labctl.cli.app import app
from labctl.errors import StoreError
from labctl.services.campaigns.execution import run_here
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.loading import load_bench
from labctl.store import Store, open_store
from labctl.store.connection.engines import sqlite_engine
from labctl.store.connection.sqlite_file import first_damage
from procedures.execution import safe_state
from tests.helpers.service import open_client

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
BENCH = load_bench("single-axis-sim")


def delete(path: Path) -> None:
    path.unlink()


def replace(path: Path) -> None:
    shutil.copy(path, path.with_suffix(".copy"))
    path.with_suffix(".copy").replace(path)


def delete_log(path: Path) -> None:
    Path(f"{path}-wal").unlink()


LOSSES = [(delete, "lab.sqlite was deleted"), (replace, "replaced by another file"), (delete_log, "-wal was deleted")]


def record(store: Store) -> None:
    store.audit.record(AT, "fit", "unit G-1", {})


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


@pytest.mark.parametrize(("lose", "says"), LOSSES)
def test_nothing_is_written_into_a_file_that_is_gone(location: str, lose: Callable[[Path], None], says: str) -> None:
    with open_store(location, write=True) as store:
        record(store)
        lose(Path(location))
        for _ in range(2):
            with pytest.raises(StoreError, match=says) as caught:
                record(store)
            assert str(caught.value).startswith(f"{location}: ")
            with pytest.raises(StoreError, match=says):
                store.audit.rows()


def test_a_connection_that_an_interrupt_closed_is_opened_anew_with_its_log(location: str) -> None:
    with open_store(location, write=True) as store:
        record(store)
        connection = store.audit._database._engine.connect()
        connection.invalidate()
        connection.close()
        assert store.audit.rows()
        record(store)
        assert len(store.audit.rows()) == 2


def test_a_file_that_is_put_back_is_written_to_again(location: str) -> None:
    path = Path(location)
    with open_store(location, write=True) as store:
        record(store)
        path.rename(path.with_suffix(".away"))
        with pytest.raises(StoreError, match="deleted"):
            record(store)
        path.with_suffix(".away").rename(path)
        record(store)
        assert len(store.audit.rows()) == 2


def test_a_log_that_comes_and_goes_with_its_connections_is_no_fault(location: str) -> None:
    for _ in range(3):
        with open_store(location, write=True) as store, open_store(location, write=False) as reader:
            record(store)
            assert reader.audit.rows()
    with open_store(location, write=True) as store:
        assert len(store.audit.rows()) == 3


@pytest.mark.parametrize(("lose", "says"), LOSSES)
def test_a_campaign_ends_in_the_safe_state_when_its_database_is_lost(
    location: str, monkeypatch: pytest.MonkeyPatch, lose: Callable[[Path], None], says: str
) -> None:
    left: list[Any] = []
    make_safe = safe_state.make_safe

    def safe(*asked: Any, **more: Any) -> Any:
        left.append(make_safe(*asked, **more))
        return left[-1]

    monkeypatch.setattr("procedures.execution.shutdown.make_safe", safe)
    lost: list[int] = []

    def seen(answer: Any) -> None:
        if answer.step == 5 and not lost:
            lost.append(answer.step)
            lose(Path(location))

    with pytest.raises(StoreError) as caught:
        run_here(location, StartRequest(recipe="short", bench=BENCH.name), seen)
    text = str(caught.value)
    assert text.startswith("campaign 1 was interrupted: ")
    assert says in text
    assert "bench single-axis-sim is safe, but that could not be recorded" in text
    assert "once the database can be written again, `labctl campaign resume 1`" in text
    assert left == [()]


def test_a_service_says_that_its_database_is_gone(location: str) -> None:
    with open_client(Path(location)) as client:
        Path(location).unlink()
        for answer in (client.get("/api/units"), client.post("/api/recordings/example", json={"name": "osu-fog"})):
            assert answer.status_code == 503
            assert "lab.sqlite was deleted while this process had it open" in answer.json()["detail"]


def test_the_next_start_finds_that_commits_are_missing(location: str) -> None:
    with open_store(location, write=True) as store:
        record(store)
        Path(location).unlink()
    assert not Path(location).exists()
    with (
        pytest.raises(StoreError, match="commits that were made are not in this database"),
        open_store(location, write=True),
    ):
        pass


def spoil(path: Path) -> None:
    """Write over the middle of every second page, as a disk does that fails."""
    content = bytearray(path.read_bytes())
    for at in range(8192, len(content), 8192):
        content[at : at + 64] = b"\xa5" * 64
    path.write_bytes(content)


@pytest.mark.parametrize("whole", [True, False])
def test_a_malformed_database_is_refused_before_it_is_written_to(
    location: str, monkeypatch: pytest.MonkeyPatch, whole: bool
) -> None:
    with open_store(location, write=True) as store:
        prepared = prepare(store, "short", BENCH, VirtualClock(), clip=False)
        prepared.bench.close()
    if not whole:
        monkeypatch.setattr("labctl.store.connection.sqlite_file.WHOLE_UP_TO_BYTES", 0)
    spoil(Path(location))
    before = Path(location).read_bytes()
    refused = CliRunner().invoke(app, ["import", "nowhere", "--database", location])
    assert refused.exit_code == 2
    with pytest.raises(StoreError, match="damaged") as caught, open_store(location, write=True):
        pass
    assert str(caught.value).startswith(f"{location}: ")
    assert "backup" in str(caught.value)
    assert Path(location).read_bytes() == before


@pytest.mark.parametrize("size", ["small", "large"])
def test_a_page_that_fits_nowhere_is_found(location: str, monkeypatch: pytest.MonkeyPatch, size: str) -> None:
    """The index of a table has lost a row: every page can be read, and they do not fit together."""
    with open_store(location, write=True) as store, store.audit._database.writing() as connection:
        connection.exec_driver_sql("PRAGMA writable_schema=ON")
        connection.exec_driver_sql("UPDATE sqlite_schema SET rootpage = 3 WHERE name = 'audit'")
    if size == "large":
        monkeypatch.setattr("labctl.store.connection.sqlite_file.WHOLE_UP_TO_BYTES", 0)
    with pytest.raises(StoreError, match="damaged"), open_store(location, write=True):
        pass


def test_blocks_of_readings_of_a_large_database_are_left_to_the_check(
    location: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_store(location, write=True) as store:
        asked: list[str] = []
        monkeypatch.setattr("labctl.store.connection.sqlite_file.WHOLE_UP_TO_BYTES", 0)
        monkeypatch.setattr(
            "labctl.store.connection.sqlite_file._damage", lambda _connection, text: asked.append(text) or ""
        )
        with store.audit._database.reading() as connection:
            assert first_damage(connection) == ""
    assert "PRAGMA quick_check('campaigns')" in asked
    assert not any("sample_blocks" in text for text in asked)


@pytest.mark.parametrize("name", ["lab.sqlite", "lab 1#2 %41?.sqlite"])
def test_a_reader_makes_no_file_where_there_was_one(tmp_path: Path, name: str) -> None:
    with open_store(str(tmp_path / name), write=True) as store:
        record(store)
    engine = sqlite_engine(str(tmp_path / name), write=False)
    with engine.connect() as connection:
        assert connection.exec_driver_sql("SELECT count(*) FROM audit").scalar() == 1
    engine.dispose()
    (tmp_path / name).unlink()
    with pytest.raises(OperationalError, match="unable to open"), engine.connect() as connection:
        connection.exec_driver_sql("SELECT 1 FROM audit")
    assert not (tmp_path / name).exists()
