"""Empty SQLite databases for tests: the migrations run once in a process, then what they made is made again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from unittest.mock import patch

import sqlalchemy as sa

from labctl.store import migrate

run_migrations = migrate.upgrade


@cache
def statements() -> tuple[str, ...]:
    """Return the SQL of an empty database that the migrations were run on."""
    engine = sa.create_engine("sqlite://")
    with engine.begin() as connection:
        run_migrations(connection)
        driver = connection.connection.driver_connection
        assert driver is not None
        made = tuple(driver.iterdump())
    engine.dispose()
    return tuple(line for line in made if line not in {"BEGIN TRANSACTION;", "COMMIT;"})


def upgrade(connection: sa.Connection) -> None:
    """Bring a database to today's tables, as `labctl.store.migrate.upgrade`: 5 ms for an empty one instead of 75."""
    if connection.dialect.name != "sqlite" or sa.inspect(connection).get_table_names():
        run_migrations(connection)
        return
    for statement in statements():
        connection.exec_driver_sql(statement)


@contextmanager
def migrated_once() -> Iterator[None]:
    """Make new SQLite databases of this process so while the block runs."""
    with patch.object(migrate, "upgrade", upgrade):
        yield
