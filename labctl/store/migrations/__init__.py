"""Numbered steps from an empty database to today's tables; they ship inside the package."""

from __future__ import annotations

from pathlib import Path

import sqlalchemy as sa
from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory

from labctl.errors import StoreError

FOLDER = Path(__file__).parent


def configuration(connection: sa.Connection | None = None) -> Config:
    """Return Alembic's settings, for a connection or for writing SQL."""
    config = Config()
    config.set_main_option("script_location", str(FOLDER))
    config.attributes["connection"] = connection
    return config


SCRIPTS = ScriptDirectory.from_config(configuration())
HEAD = SCRIPTS.get_current_head()
KNOWN = frozenset(script.revision for script in SCRIPTS.walk_revisions())


def revision_of(connection: sa.Connection) -> str | None:
    """Return the step at which a database stands; None for an empty one."""
    return MigrationContext.configure(connection).get_current_revision()


def refuse_unknown(revision: str | None, location: str) -> None:
    """Raise StoreError when a database stands at a step that this code does not know."""
    if revision is not None and revision not in KNOWN:
        raise StoreError(
            f"{location}: the database is at step {revision!r}, which is newer than this labctl (step {HEAD!r}); "
            "use the labctl that made it, or a newer one. Nothing was changed"
        )


def upgrade(connection: sa.Connection) -> None:
    """Bring a database to today's tables, inside the transaction of `connection`."""
    command.upgrade(configuration(connection), "head")
