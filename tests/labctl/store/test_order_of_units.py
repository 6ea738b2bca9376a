"""Units in natural order: the same in a file and on a server, in parts and whole, also where a database is migrated."""

from __future__ import annotations

import random
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic import command

from labctl.natural_order import natural_key
from labctl.store import migrate, migrate_database
from labctl.store.connection.database import Database
from labctl.store.paging import PageRequest
from labctl.store.repositories.fleet_filter import FleetFilter
from labctl.store.repositories.fleet_jobs import FleetJobs, NewFleetJob
from labctl.store.repositories.units import Certifications, Units
from labctl.store.schema import tables

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
#: Against what a language of a server sorts by: case, and punctuation that a language passes over.
SERIALS = ["A-1", "A-2", "A-02", "A-10", "A-100", "A.3", "A1", "A9", "A10", "B-1", "B_2", "a-2", "a-10"]


@pytest.fixture(params=["file", "server"])
def location(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    return str(tmp_path / "lab.sqlite") if request.param == "file" else str(request.getfixturevalue("url"))


def shuffled() -> list[str]:
    return random.Random(1).sample(SERIALS, len(SERIALS))


def add_units(connection: sa.Connection) -> None:
    recording = {"kind": "points", "info": {}, "channels": [], "created_at": AT}
    for serial in shuffled():
        connection.execute(sa.insert(tables.units).values(serial=serial, model="VG-35", first_seen_at=AT))
        connection.execute(sa.insert(tables.recordings).values(serial=serial, **recording))
        made = {"serial": serial, "version": 1, "model": "cubic", "hash": serial, "document": b"{}", "answer": {}}
        connection.execute(sa.insert(tables.calibrations).values(**made, created_at=AT))
        act = {"serial": serial, "version": 1, "act": "certify", "by": "Ada", "reason": "", "at": AT}
        connection.execute(sa.insert(tables.certifications).values(**act))


def in_parts(units: Units, limit: int) -> Iterator[str]:
    after = None
    while True:
        page = units.page(PageRequest("", limit, after))
        yield from (unit.serial for unit in page.rows)
        assert page.total == len(SERIALS)
        if page.next_after is None:
            return
        after = page.next_after


def test_units_are_listed_in_natural_order(location: str) -> None:
    database = Database(location, write=True)
    with database.writing() as connection:
        add_units(connection)
    units, jobs = Units(database), FleetJobs(database)
    assert [unit.serial for unit in units.all()] == SERIALS
    assert all(list(in_parts(units, limit)) == SERIALS for limit in (1, 4, len(SERIALS)))
    assert [unit.serial for unit in units.page(PageRequest("", 2, "A-5")).rows] == ["A-10", "A-100"]  # none is A-5
    assert [serial for serial, _ in Certifications(database).newest_versions()] == SERIALS
    assert jobs.serials(FleetFilter(), "", 4) + jobs.serials(FleetFilter(), SERIALS[3], 100) == SERIALS
    job = jobs.begin(NewFleetJob("fit", {}, "local", "Ada"), FleetFilter(), "", AT)
    first = jobs.units(job, PageRequest("", 5, None))
    rest = jobs.units(job, PageRequest("", None, first.next_after))
    assert [row.serial for row in [*first.rows, *rest.rows]] == SERIALS
    database.close()


def test_an_earlier_database_is_migrated_to_the_natural_order(location: str) -> None:
    Database(location, write=True).close()
    engine = sa.create_engine(location if "://" in location else f"sqlite:///{location}")
    with engine.begin() as connection:
        command.downgrade(migrate.configuration(connection), "0027")
        names = [column["name"] for column in sa.inspect(connection).get_columns("units")]
        assert "serial_key" not in names
        units = sa.table("units", *(sa.column(name) for name in ("serial", "model", "first_seen_at")))
        connection.execute(
            sa.insert(units), [{"serial": serial, "model": "m", "first_seen_at": 0} for serial in shuffled()]
        )
    engine.dispose()
    assert migrate_database(location, copy=False).before == "0027"
    database = Database(location, write=False)
    with database.reading() as connection:
        c = tables.units.c
        rows = connection.execute(sa.select(c.serial, c.serial_key).order_by(c.serial_key)).all()
    database.close()
    assert [row.serial for row in rows] == SERIALS
    assert [row.serial_key for row in rows] == [natural_key(serial) for serial in SERIALS]
