"""What a migration has done, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from labctl.answers.admin import MigrationResponse


def migration_text(answer: MigrationResponse) -> str:
    """Return what was done, in one line."""
    if answer.from_schema == answer.to_schema:
        return f"{answer.database}: the schema is number {answer.to_schema} already; nothing was changed"
    copy = "no copy was made" if answer.copied_to is None else f"the database as it was: {answer.copied_to}"
    return f"{answer.database}: migrated from schema {answer.from_schema} to {answer.to_schema}; {copy}"
