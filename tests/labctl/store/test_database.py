"""One writer, known steps, nothing half-written."""

from __future__ import annotations

import io
import sqlite3
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy.dialects import postgresql

from labctl.errors import BadInput, Conflict, NotCertified, NotFound, StoreError
from labctl.recording import Recording, RecordingInfo, to_points
from labctl.store import (
    Judgement,
    NewCalibration,
    ServiceAddress,
    Store,
    database_name,
    holder_of,
    migrate,
    migrate_database,
    open_store,
)
from labctl.store.connection.database import Database
from labctl.store.schema import tables
from tests.helpers import migrated_databases

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.fixture
def location(tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite")


def samples(seed: int = 1) -> Recording:
    rng = np.random.default_rng(seed)
    columns = {
        "dataset": np.repeat([1, 2, 3], 200),
        "t_s": np.arange(600) * 0.1,
        "position": np.full(600, "z"),
        "run": np.ones(600, dtype=np.int64),
        "mounting": np.ones(600, dtype=np.int64),
        "table_rate_dps": np.repeat([0.0, 10.0, -10.0], 200),
        "temperature_c": rng.normal(25, 0.1, 600),
        "humidity_rh": rng.normal(40, 1, 600),
        "gyro_z": rng.normal(0, 1, 600),
        "valid": (rng.uniform(size=600) > 0.1).astype(np.int64),
    }
    info = RecordingInfo(serial="G-1", model="M", axes=("z",), kind="samples", started_at=AT, technology="fog")
    environment = {"t_s": np.array([0.0, 10.0]), "run": np.array([1, 1]), "temperature_c": np.array([25.0, 25.5])}
    return Recording(info, columns, environment)


@pytest.mark.slow
def test_migrations_make_todays_tables(location: str) -> None:
    with open_store(location, write=True):
        pass
    engine = sa.create_engine(f"sqlite:///{location}")
    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": False})
        assert compare_metadata(context, tables.metadata) == []
    engine.dispose()


def test_databases_of_tests_are_what_the_migrations_make(tmp_path: Path) -> None:
    made: list[list[str]] = []
    for name, upgrade in (("migrated", migrated_databases.run_migrations), ("copied", migrated_databases.upgrade)):
        engine = sa.create_engine(f"sqlite:///{tmp_path / name}")
        with engine.begin() as connection:
            upgrade(connection)
            driver = connection.connection.driver_connection
            assert driver is not None
            made.append(list(driver.iterdump()))
        engine.dispose()
    assert made[0] == made[1]


def test_the_steps_are_those_that_alembic_finds(location: str) -> None:
    scripts = ScriptDirectory.from_config(migrate.configuration())
    assert scripts.get_current_head() == migrate.HEAD
    assert {script.revision for script in scripts.walk_revisions()} == migrate.KNOWN
    engine = sa.create_engine(f"sqlite:///{location}")
    with engine.connect() as connection:
        assert migrate.revision_of(connection) is None
    with open_store(location, write=True), engine.connect() as connection:
        assert migrate.revision_of(connection) == migrate.HEAD
        assert MigrationContext.configure(connection).get_current_revision() == migrate.HEAD
    engine.dispose()


def test_migrations_can_be_written_for_postgresql() -> None:
    out = io.StringIO()
    config = migrate.configuration()
    config.output_buffer = out
    config.set_main_option("sqlalchemy.url", "postgresql+psycopg://nowhere/none")
    command.upgrade(config, "head", sql=True)
    text = out.getvalue()
    assert "CREATE TABLE sample_blocks" in text
    assert "BYTEA" in text
    assert "ALTER TABLE certifications ADD COLUMN override BOOLEAN" in text
    assert "ALTER TABLE recordings ADD COLUMN importing VARCHAR(32)" in text
    for table in tables.metadata.sorted_tables:
        assert str(sa.schema.CreateTable(table).compile(dialect=postgresql.dialect()))


def test_a_newer_database_is_refused_and_left_alone(location: str) -> None:
    with open_store(location, write=True):
        pass
    with sqlite3.connect(location) as raw:
        raw.execute("UPDATE alembic_version SET version_num = '9999'")
    raw.close()
    before = Path(location).read_bytes()
    with (
        pytest.raises(StoreError, match="this version of labctl knows only up to number"),
        open_store(location, write=True),
    ):
        pass
    assert Path(location).read_bytes() == before


def test_something_else_is_refused(location: str) -> None:
    Path(location).write_bytes(b"this is not a database at all" * 100)
    with pytest.raises(StoreError, match="not a labctl database, or damaged"), open_store(location, write=True):
        pass


def test_a_second_writer_gets_the_holder_in_the_error(location: str) -> None:
    with open_store(location, write=True, address=ServiceAddress("http://127.0.0.1:1")) as store:
        holder = holder_of(location)
        assert holder is not None
        assert holder.url == "http://127.0.0.1:1"
        with (
            pytest.raises(Conflict, match=r"the service at http://127\.0\.0\.1:1 is writing"),
            open_store(location, write=True),
        ):
            pass
        with open_store(location, write=False) as reader:
            assert reader.units.all() == []
        store.recordings.add_import(samples(), AT)
        with open_store(location, write=False) as reader:
            assert [unit.serial for unit in reader.units.all()] == ["G-1"]
    assert holder_of(location) is None


def test_a_reader_cannot_write(location: str) -> None:
    with (
        open_store(location, write=False) as reader,
        pytest.raises(StoreError, match="readonly"),
    ):
        reader.recordings.add_import(samples(), AT)


def test_an_import_comes_back_exactly(location: str) -> None:
    given = samples()
    with open_store(location, write=True) as store:
        number = store.recordings.add_import(given, AT)
        back = store.recordings.samples(number)
        points, expected = store.recordings.points(number), to_points(given)
        head = store.recordings.get(number)
    for name, values in given.columns.items():
        assert np.array_equal(back.columns[name], values), name
    assert back.environment is not None
    assert np.array_equal(back.environment["temperature_c"], [25.0, 25.5])
    for name in ("gyro_z", "temperature_c", "humidity_rh", "gyro_z_std", "table_rate_dps", "t_s"):
        assert points.columns[name] == pytest.approx(expected.columns[name], abs=1e-12), name
    assert points.columns["n"].tolist() == expected.columns["n"].tolist()
    assert head.readings == int(given.columns["valid"].sum())


def test_nothing_is_left_of_an_import_that_fails(location: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_store(location, write=True) as store:
        monkeypatch.setattr("labctl.store.import_parts._environment", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            store.recordings.add_import(samples(), AT)
        assert store.units.all() == []
        with pytest.raises(NotFound):
            store.recordings.get(1)


def _calibration(version: int) -> NewCalibration:
    return NewCalibration(None, None, "m", f"document {version}".encode(), "h" * 64, {"error": {}})


def add_next(store: Store, at: datetime = AT) -> int:
    version = store.calibrations.next_version("G-1")
    return store.calibrations.add("G-1", at, version, _calibration(version)).version


@pytest.fixture
def store(location: str) -> Store:
    with open_store(location, write=True) as opened:
        opened.recordings.add_import(samples(), AT)
        yield opened  # type: ignore[misc]


def test_versions_count_per_unit_and_never_change(store: Store) -> None:
    assert [add_next(store) for _ in range(3)] == [1, 2, 3]
    assert store.calibrations.document("G-1", 2) == (b"document 2", "h" * 64)
    with pytest.raises(NotFound, match="no calibration version 4"):
        store.calibrations.document("G-1", 4)


def test_certifying_an_older_version_is_a_rollback(store: Store) -> None:
    for _ in range(2):
        add_next(store)
    with pytest.raises(NotCertified):
        store.calibrations.certified_version("G-1")
    act: Callable[..., object] = store.calibrations.certify
    act("G-1", 2, "certify", by="A", reason="new", at=AT)
    act("G-1", 1, "certify", by="B", reason="the new one drifts", at=AT)
    assert store.calibrations.certified_version("G-1") == 1
    with pytest.raises(Conflict, match="not in force"):
        act("G-1", 2, "revoke", by="B", reason="wrong", at=AT)
    act("G-1", 1, "revoke", by="B", reason="lost trust", at=AT)
    with pytest.raises(NotCertified):
        store.calibrations.certified_version("G-1")
    assert [row.act for row in store.calibrations.history("G-1")] == ["revoke", "certify", "certify"]


def test_acts_of_before_verdicts_were_kept_have_none(store: Store, location: str) -> None:
    """A database that stood at step 0005 is migrated; its acts have null where later ones have a verdict."""
    add_next(store)
    store.calibrations.certify("G-1", 1, "certify", by="A", reason="fits", at=AT)
    with store.calibrations._database.writing() as connection:
        command.downgrade(migrate.configuration(connection), "0005")
        columns = {column["name"] for column in sa.inspect(connection).get_columns("certifications")}
        assert columns == {"id", "serial", "version", "act", "by", "reason", "at", "due_at"}
    store.close()
    known = Judgement("missing", 1, AT, True, {"verdict_text": "So it is.", "objections": [{"text": "it lacks"}]})
    migrate_database(location, copy=False)
    with open_store(location, write=True) as migrated:
        assert [row.judgement for row in migrated.calibrations.history("G-1")] == [None]
        assert migrated.calibrations.certified_version("G-1") == 1
        migrated.calibrations.certify("G-1", 1, "certify", by="B", reason="again", at=AT, judgement=known)
        migrated.calibrations.certify("G-1", 1, "revoke", by="B", reason="not now", at=AT)
        assert [row.judgement for row in migrated.calibrations.history("G-1")] == [None, known, None]
        detail = migrated.audit.rows()[-2].detail
        assert (detail["verdict"], detail["recording"], detail["override"]) == ("missing", 1, True)
        assert (detail["objections"], detail["verdict_at"]) == (["it lacks"], AT.isoformat())
        assert migrated.audit.first_broken() is None


def test_naive_instants_are_refused(store: Store) -> None:
    with pytest.raises(sa.exc.StatementError, match="has no time zone"):
        add_next(store, datetime(2026, 1, 1))  # noqa: DTZ001  that is the point


@pytest.mark.parametrize("url", [
    "postgres://ada:secret@x/y", "sqlite:///lab.sqlite", "nonsense://ada:s@cret@x", "://ada:secret@",
    "postgresql+psycopg://ada:secret@x:port/y", "postgresql+psycopg9://ada:secret@x/y",
])  # fmt: skip
def test_a_database_url_that_labctl_does_not_know_is_refused_without_its_password(url: str) -> None:
    with pytest.raises(BadInput, match=r"--database .*path of an SQLite file, or postgresql\+psycopg://") as caught:
        Store(Database(url, write=False))
    assert url.partition("://")[0] in str(caught.value)
    assert "secret" not in str(caught.value)
    assert "cret" not in str(caught.value)


def test_all_recordings_of_a_version_are_kept_and_the_step_can_be_taken_back(store: Store, location: str) -> None:
    """Versions of before step 0011 have the recording that they were fitted to; taken back, the newest stays."""
    first = store.recordings.of_unit("G-1")[0].id
    second = store.recordings.add_import(samples(2), AT)
    store.calibrations.add("G-1", AT, 1, replace(_calibration(1), recording=second, recordings=(first, second)))
    assert store.calibrations.get("G-1", 1).recordings == (first, second)
    assert store.audit.rows()[-1].detail["recordings"] == [first, second]
    with store.calibrations._database.writing() as connection:
        command.downgrade(migrate.configuration(connection), "0010")
        assert not sa.inspect(connection).has_table("calibration_recordings")
    store.close()
    migrate_database(location, copy=False)
    with open_store(location, write=True) as migrated:
        assert migrated.calibrations.get("G-1", 1).recordings == (second,)
        assert migrated.calibrations.get("G-1", 1).recording == second


@pytest.mark.parametrize(
    ("location", "name"),
    [
        ("/var/lib/labctl/lab.sqlite", "lab.sqlite"),
        ("postgresql+psycopg://ann:hunter2@db.lab/gyros", "gyros"),
        ("postgresql+psycopg://ann@/gyros?host=/run/postgresql&port=5433", "gyros"),
        ("sqlite:////var/lib/labctl/lab.sqlite", "lab.sqlite"),
    ],
)
def test_the_name_of_a_database_shows_no_folder_host_or_password(location: str, name: str) -> None:
    assert database_name(location) == name
