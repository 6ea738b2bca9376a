"""Upgrades a database by the revisions of `migrations`, which ship inside the package.

Alembic takes 0.1 s to load, so only an upgrade loads it: the revision of a database is one row of its table, and
the known revisions are the names of their files.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import sqlalchemy as sa

from labctl.errors import StoreError

if TYPE_CHECKING:
    from alembic.config import Config

FOLDER = Path(__file__).parent / "migrations"
KNOWN = frozenset(path.stem.partition("_")[0] for path in (FOLDER / "versions").glob("[0-9]*.py"))
HEAD = max(KNOWN)
#: Where a database stands that `labctl move-database` has not filled yet.
MOVING = "moving"
STANDS_AT = sa.table("alembic_version", sa.column("version_num"))


def configuration(connection: sa.Connection | None = None) -> Config:
    """Return Alembic's settings, for a connection or for writing SQL."""
    from alembic.config import Config  # noqa: PLC0415  as above

    config = Config()
    config.set_main_option("script_location", str(FOLDER))
    config.attributes["connection"] = connection
    return config


def revision_of(connection: sa.Connection) -> str | None:
    """Return the step at which a database stands; None for an empty one."""
    if not sa.inspect(connection).has_table(STANDS_AT.name):
        return None
    return connection.scalar(sa.select(STANDS_AT.c.version_num))


def refuse_unknown(revision: str | None, location: str) -> None:
    """Raise StoreError when a database stands at a step that this code does not know."""
    if revision == MOVING:
        raise StoreError(
            f"{location}: `labctl move-database` into this database has not ended; run it again with the same databases"
        )
    if revision is not None and revision not in KNOWN:
        raise StoreError(
            f"{location}: the schema of the database is number {revision!r}, but this version of labctl knows "
            f"only up to number {HEAD!r}. Nothing was changed; use the version of labctl that made the "
            "database, or a newer one"
        )


def upgrade(connection: sa.Connection) -> None:
    """Migrate a database to the present tables, inside the transaction of `connection`."""
    from alembic import command  # noqa: PLC0415  as above

    command.upgrade(configuration(connection), "head")
