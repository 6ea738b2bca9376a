"""The same statements on a PostgreSQL server: equal rows, one writer at a time, and a server that goes away."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import psycopg
import pytest
import sqlalchemy as sa

from labctl.answers.campaigns import CampaignRequest, StartRequest
from labctl.answers.certification import RevokeRequest
from labctl.errors import DatabaseUnreachable, StoreError
from labctl.services.calibrations.certification import revoke
from labctl.services.calibrations.served import calibration_file
from labctl.services.calibrations.stability import Stability, stability_of
from labctl.services.campaigns.execution import run_here
from labctl.services.certificates.issue import issue
from labctl.services.certificates.states import list_certificates
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import add_start
from labctl.store import (
    CheckGyroRow,
    FetchRow,
    NewReleaseRequest,
    NewSensorVersion,
    Release,
    RoomReading,
    Store,
    check,
    open_store,
)
from labctl.store.connection import postgresql_server
from labctl.store.connection.database import Database
from labctl.store.integrity.migration import migrate_database
from labctl.store.paging import PageRequest
from labctl.store.schema import tables
from studies.postgresql_cluster import Cluster
from tests.helpers import certificates, register
from tests.helpers.certificates import simulated
from tests.helpers.drifting_units import add_drifting_unit
from tests.helpers.log_records import logged
from tests.helpers.schedule_lab import Lab

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)


def note(store: Store, number: int) -> None:
    store.audit.record(AT, "noted", f"row {number}", {"number": number})


def subjects(store: Store) -> list[str]:
    return [row.subject for row in store.audit.rows()]


def rows_of(location: str) -> dict[str, list[Any]]:
    """Return every row of every table but the leases, which a file needs for real benches alone.

    Numbers of blocks are left out: SQLite gives those of deleted rows again.
    """
    blocks = tables.sample_blocks
    shown = {table: list(table.columns) for table in tables.metadata.sorted_tables if table.name != "leases"}
    shown[blocks].remove(blocks.c.id)
    database = Database(location, write=False)
    with database.reading() as connection:
        found = {
            table.name: sorted((tuple(row) for row in connection.execute(sa.select(*columns))), key=repr)
            for table, columns in shown.items()
        }
    database.close()
    return found


@pytest.mark.slow
def test_a_campaign_leaves_the_same_rows_as_in_a_file(url: str, tmp_path: Path) -> None:
    path = str(tmp_path / "lab.sqlite")
    for location in (path, url):
        assert run_here(location, StartRequest(recipe="short", bench="single-axis-sim")).state == "done"
    in_file, on_server = rows_of(path), rows_of(url)
    assert sum(map(len, in_file.values())) > 100
    for name in in_file:
        assert on_server[name] == in_file[name], name


def test_the_migrated_tables_match_the_declared_ones(url: str) -> None:
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    database = Database(url, write=True)
    with database.reading() as connection:
        differences = compare_metadata(MigrationContext.configure(connection), tables.metadata)
    database.close()
    (kind, index), *others = differences
    assert (kind, index.name, others) == ("remove_index", postgresql_server.SEARCH_INDEX, [])  # of servers alone


def test_units_are_found_by_an_index_of_any_part_of_their_texts(url: str) -> None:
    with open_store(url, write=True):
        pass
    found = PageRequest("g-0012", 50).matching((tables.units.c.serial, tables.units.c.model, tables.units.c.supplier))
    engine = sa.create_engine(url)
    with engine.connect() as connection:
        connection.exec_driver_sql("SET enable_seqscan = off")
        query = sa.select(tables.units).where(found).compile(engine, compile_kwargs={"literal_binds": True})
        plan = "\n".join(connection.execute(sa.text(f"EXPLAIN {query}".replace(":", "\\:"))).scalars())
    engine.dispose()
    assert postgresql_server.SEARCH_INDEX in plan


@pytest.mark.slow
def test_a_server_without_the_extension_is_searched_without_the_index(
    url: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with monkeypatch.context() as without, logged(tmp_path) as records:
        without.setattr(postgresql_server, "SEARCH_EXTENSION", "no_such_extension")
        with open_store(url, write=True) as store:
            assert store.units.page(PageRequest("x", 5)).rows == []
    (said,) = records.named("search.not_indexed")
    assert "labctl migrate --without-copy" in said["text"]

    def has_index() -> bool:
        engine = sa.create_engine(url)
        with engine.connect() as connection:
            names = {index["name"] for index in sa.inspect(connection).get_indexes("units")}
        engine.dispose()
        return postgresql_server.SEARCH_INDEX in names

    assert not has_index()
    assert migrate_database(url, copy=False).copy is None
    assert has_index()


def test_two_that_make_the_tables_at_the_same_time_do_not_meet(url: str) -> None:
    with ThreadPoolExecutor(4) as threads:
        opened = list(threads.map(lambda _: Database(url, write=True), range(4)))
    for database in opened:
        database.close()
    assert len(opened) == 4


def test_the_audit_trail_of_several_writers_is_one_chain(url: str) -> None:
    def write(first: int) -> None:
        with open_store(url, write=True) as store:
            for number in range(first, first + 10):
                note(store, number)

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(write, range(0, 40, 10)))
    with open_store(url, write=False) as store:
        assert store.audit.first_broken() is None
        assert sorted(subjects(store)) == sorted(f"row {k}" for k in range(40))


def test_a_start_that_two_services_find_due_is_begun_once(url: str) -> None:
    """A service that has lost its bench to another may still read the schedule."""
    with open_store(url, write=True) as one, open_store(url, write=True) as other:
        labs = [Lab(one), Lab(other)]
        starts = [labs[0].enter(at="now") for _ in range(6)]
        elsewhere = load_bench("triaxial-sim")
        add_start(one, CampaignRequest(recipe="verified-triaxial", at="now"), elsewhere, labs[0].clock.utc())
        with ThreadPoolExecutor(2) as threads:
            list(threads.map(lambda lab: lab.scheduler.tick(), labs))
        assert sum(len(lab.begun) for lab in labs) == len(starts)
        assert [labs[0].outcomes(each) for each in starts] == [["refused"]] * len(starts)
        assert [row.bench_name for row in one.starts.all(ended=False)] == [elsewhere.name]
        assert one.audit.first_broken() is None


def test_a_reader_can_change_nothing(url: str) -> None:
    database = Database(url, write=True)
    with database.reading() as connection, pytest.raises(sa.exc.DBAPIError, match="read-only"):
        connection.execute(sa.delete(tables.audit))
    database.close()


@pytest.mark.parametrize("how", ["fast", "immediate"])
def test_a_server_that_is_restarted_fails_no_write_and_no_read(cluster: Cluster, url: str, how: str) -> None:
    with open_store(url, write=True) as store:
        note(store, 1)
        cluster.stop(how=how)
        starting = threading.Thread(target=cluster.start)
        starting.start()
        try:
            note(store, 2)
            assert subjects(store) == ["row 1", "row 2"]
        finally:
            starting.join()


@pytest.mark.slow
def test_a_campaign_goes_on_while_its_server_is_restarted(
    cluster: Cluster, url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from labctl.store.repositories.campaign_journal import StoreJournal

    restarts: list[str] = []
    before = StoreJournal.dataset_closed

    def restart_first(self: StoreJournal, dataset: int, *args: Any) -> None:
        if dataset in {2, 5}:
            how = "immediate" if dataset == 2 else "fast"
            cluster.stop(how=how)
            cluster.start()
            restarts.append(how)
        before(self, dataset, *args)

    monkeypatch.setattr(StoreJournal, "dataset_closed", restart_first)
    ended = run_here(url, StartRequest(recipe="short", bench="single-axis-sim"))
    assert (ended.state, restarts) == ("done", ["immediate", "fast"]), ended.reason
    with open_store(url, write=False) as store:
        sets = store.recordings.points(1).columns
        assert len(sets["n"]) == 15
        assert len(set(sets["dataset"].tolist())) == 15
        assert store.audit.first_broken() is None


class _LostCommit:
    """A connection that is lost at the next commit, before or after the server has made it."""

    def __init__(self, store: Store, *, kept: bool) -> None:
        self._dialect = store.audit._database._engine.dialect
        self._commit: Callable[[Any], None] = self._dialect.do_commit
        self._kept, self.lost = kept, 0

    def __call__(self, connection: Any) -> None:
        if self.lost:
            self._commit(connection)
            return
        self.lost += 1
        if self._kept:
            self._commit(connection)
        connection.driver_connection.close()
        raise psycopg.OperationalError("the connection is lost")


@pytest.mark.parametrize("kept", [True, False])
def test_a_commit_that_was_not_answered_is_made_once(url: str, monkeypatch: pytest.MonkeyPatch, kept: bool) -> None:
    with open_store(url, write=True) as store:
        losing = _LostCommit(store, kept=kept)
        monkeypatch.setattr(store.audit._database._engine.dialect, "do_commit", losing)
        note(store, 1)
        assert losing.lost == 1
        assert subjects(store) == ["row 1"]


def test_an_unreachable_server_is_reported(cluster: Cluster, url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(postgresql_server, "WRITER_PATIENCE_S", 0.2)
    with open_store(url, write=True) as store:
        cluster.stop()
        try:
            with pytest.raises(DatabaseUnreachable, match=r"does not answer .*nothing was stored"):
                note(store, 1)
            with pytest.raises(DatabaseUnreachable):
                subjects(store)
        finally:
            cluster.start()
        note(store, 2)
        assert subjects(store) == ["row 2"]


@pytest.mark.parametrize(("part", "wrong"), [("database", "nowhere"), ("username", "nobody")])
@pytest.mark.parametrize("write", [True, False])
def test_a_refused_connection_is_said_at_once(url: str, part: str, wrong: str, write: bool) -> None:
    elsewhere = sa.make_url(url).set(**{part: wrong}).render_as_string(hide_password=False)
    begun_s = time.monotonic()
    said = r"refuses the connection .*check user, password and database in the URL"
    with pytest.raises(StoreError, match=said), open_store(elsewhere, write=write):
        pass
    assert time.monotonic() - begun_s < postgresql_server.READER_PATIENCE_S


def read_and_note(url: str) -> None:
    with open_store(url, write=True) as store:
        assert subjects(store) == ["row 1"]
        note(store, 2)


@pytest.mark.parametrize(
    ("rights", "lacking"),
    [
        ("", "permission denied for table alembic_version"),
        ("SELECT", "permission denied for table audit_head"),
        ("SELECT, INSERT, UPDATE", "permission denied for sequence audit_id_seq"),
    ],
)
def test_a_user_without_a_right_is_said_with_the_right(url: str, rights: str, lacking: str) -> None:
    with open_store(url, write=True) as store:
        note(store, 1)
    user = f"limited_{len(rights)}"
    with psycopg.connect(sa.make_url(url).set(drivername="postgresql").render_as_string(), autocommit=True) as owner:
        owner.execute(f"DROP ROLE IF EXISTS {user}")
        owner.execute(f"CREATE ROLE {user} LOGIN")
        if rights:
            owner.execute(f"GRANT {rights} ON ALL TABLES IN SCHEMA public TO {user}")
    limited = sa.make_url(url).set(username=user).render_as_string()
    expected = f"the user '{user}' of the database lacks a right .{lacking}.; the owner of the tables gives it: SELECT"
    with pytest.raises(StoreError, match=expected):
        read_and_note(limited)
    with open_store(url, write=True) as store:
        assert subjects(store) == ["row 1"]


def opened(url: str, monkeypatch: pytest.MonkeyPatch, **limits: float) -> Store:
    """Open the database with limits of its own."""
    with monkeypatch.context() as changed:
        for name, limit in limits.items():
            changed.setattr(postgresql_server, name, limit)
        return Store(Database(url, write=True))


def test_a_writer_that_hangs_is_told_and_then_ended_by_the_server(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    hasty, patient = opened(url, monkeypatch, LOCK_TIMEOUT_S=0.2), opened(url, monkeypatch)
    hanging = opened(url, monkeypatch, IDLE_TIMEOUT_S=3)

    def hang() -> None:
        with hanging.audit._database.writing():
            with pytest.raises(StoreError, match=r"no write access within .*another process holds the lock"):
                note(hasty, 1)
            note(patient, 2)

    with pytest.raises(StoreError, match="does not answer"):
        hang()
    assert subjects(patient) == ["row 2"]
    for store in (hasty, patient, hanging):
        store.close()


@pytest.mark.slow
def test_the_life_of_a_certificate_is_the_same_on_a_server(url: str) -> None:
    with open_store(url, write=True) as store:
        certificates.add_version(store)
        number = issue(store, certificates.SERIAL, 1, certificates.request(), AT).number
        for last_s in (5, 1):
            row = FetchRow(certificates.SERIAL, 1, "robot", AT, AT + timedelta(seconds=last_s))
            store.fetches.record([row])
        answer = revoke(store, certificates.SERIAL, 1, RevokeRequest(by="Rita", reason="was dropped"), AT)
        assert answer.withdrawn_certificates == [number]
        assert [each.last_at for each in answer.fetched_by] == [AT + timedelta(seconds=5)]
        (row_of_list,) = list_certificates(store, certificates.SERIAL)
        assert (row_of_list.state, row_of_list.state_reason) == ("withdrawn", "was dropped")
        assert calibration_file(store, certificates.SERIAL, 1, "json").withdrawn is not None
        new = NewReleaseRequest(certificates.SERIAL, 1, "Ada", "ada", "again", AT, 30, override=True)
        asked = store.release_requests.add(new)
        assert store.release_requests.waiting(certificates.SERIAL) == [asked]
        second = Release("Bob", "bob", "checked", asked.id)
        store.calibrations.certify(certificates.SERIAL, 1, "certify", by="Ada", reason="r", at=AT, release=second)
        assert store.release_requests.waiting(certificates.SERIAL) == []
        assert store.calibrations.history(certificates.SERIAL)[0].release == second
    assert check(url).findings == ()


@pytest.mark.slow
def test_the_register_of_standards_is_the_same_as_in_a_file(url: str, tmp_path: Path) -> None:
    path = str(tmp_path / "lab.sqlite")
    for location in (path, url):
        with open_store(location, write=True) as store:
            register.add(store)
            register.certificate(store, "T-1", AT.date(), 0.010, due="2027-01-31")
            register.check(store, AT.date(), 0.012)
            register.bad(store, AT.date(), None, AT.date())
            reading = RoomReading(AT, "", "temperature", "deg C", 21.5, "TH-3")
            store.room_environment.add([reading], AT, "T. Technician")
            store.units.get(store.recordings.get(store.recordings.add_import(simulated(), AT)).serial)
            store.check_gyros.add(CheckGyroRow("FOG-0001", "mark", 25.0, AT.date(), "stays", "Q", AT))
            new = NewSensorVersion("IMU-7", "accelerometer", "adequate", {"files": []}, {"text": ["a"], "u": 1e-5}, "Q")
            assert [store.sensor_versions.add(new, AT).version for _ in range(2)] == [1, 2]
            assert [each.result for each in store.sensor_versions.of_unit("IMU-7")] == [new.result] * 2
            assert store.standards.get("SN-0815") == store.standards.all()[0]
            assert [each.high for each in store.room_environment.spans(AT, AT, "any")] == [21.5]
            assert [each.chart_from for each in store.check_gyros.all()] == [AT.date()]
        assert not check(location).findings
    in_file, on_server = rows_of(path), rows_of(url)
    assert len(in_file["sensor_versions"]) == 2
    for name in ("standards", "standard_certificates", "standard_checks", "standard_findings", "check_gyros"):
        assert len(in_file[name]) == 1
    for name in (*in_file.keys() - {"block_digests"},):
        assert on_server[name] == in_file[name], name


@pytest.mark.slow
def test_the_drift_of_a_type_is_the_same_on_a_server(url: str, tmp_path: Path) -> None:
    found = []
    for place in (url, str(tmp_path / "lab.sqlite")):
        with open_store(place, write=True) as store:
            for years, drift in enumerate((0.01, 0.03, 0.014), start=1):
                add_drifting_unit(store, f"A-{years}", {0.0: 0.0, float(years): drift * years})
            add_drifting_unit(store, "N-1", {1.0: 0.0})
            known = stability_of(store, "N-1", 1)
            assert isinstance(known, Stability)
            assert known.of_type is not None
            found.append((known.worst, known.mean_dps(1.0), known.of_type.units, known.of_type.over_years))
            assert store.certified_versions.benches([]) == {}
    assert found[0] == found[1]
