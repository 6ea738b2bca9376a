"""Alembic's entry: runs the revisions on a connection, or writes them as SQL.

`labctl.store.migrate` gives the connection. For a developer's `alembic` command the database is the one of labctl:
LABCTL_DATABASE, by default the user's own; it is held for writing meanwhile.
"""

from __future__ import annotations

from contextlib import closing
from typing import Any, Literal

import sqlalchemy as sa
from alembic import context
from alembic.autogenerate.api import AutogenContext
from alembic.operations.ops import MigrationScript
from alembic.script import ScriptDirectory

from labctl.store.schema.tables import Instant, metadata


def number_revision(_context: Any, _revision: Any, scripts: list[MigrationScript]) -> None:
    """Give a new revision the next number, unless `--rev-id` names it."""
    if getattr(context.config.cmd_opts, "rev_id", None) is None:
        head = ScriptDirectory.from_config(context.config).get_current_head()
        scripts[0].rev_id = f"{int(head or 0) + 1:04d}"


def render_item(kind: str, item: Any, _context: AutogenContext) -> str | Literal[False]:
    """Write the project's own column types as those of the database: a revision does not change with the code."""
    return "sa.BigInteger()" if kind == "type" and isinstance(item, Instant) else False


def run(connection: sa.Connection) -> None:
    """Run the revisions on a connection, inside its transaction."""
    context.configure(
        connection=connection,
        target_metadata=metadata,
        render_as_batch=True,
        render_item=render_item,
        process_revision_directives=number_revision,
    )
    context.run_migrations()


def run_on_default_database() -> None:
    """Run the revisions on the database of labctl."""
    from labctl.config import default_database  # noqa: PLC0415  only a developer's command needs it
    from labctl.store.connection.database import Database  # noqa: PLC0415

    with closing(Database(default_database(), write=True, as_it_is=True)) as database, database.writing() as connection:
        run(connection)


def write_sql() -> None:
    """Write the revisions as SQL for the dialect of `sqlalchemy.url`, by default that of labctl's database."""
    from labctl.config import default_database  # noqa: PLC0415
    from labctl.store.connection.location import is_url  # noqa: PLC0415

    url = context.config.get_alembic_option("sqlalchemy.url") or default_database()
    context.configure(url=url if is_url(url) else f"sqlite:///{url}", target_metadata=metadata, literal_binds=True)
    with context.begin_transaction():
        context.run_migrations()


if context.is_offline_mode():
    write_sql()
elif (given := context.config.attributes.get("connection")) is not None:
    run(given)
else:
    run_on_default_database()
