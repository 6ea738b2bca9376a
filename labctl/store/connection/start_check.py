"""The check of an SQLite file before this process writes to it: a damaged one is refused, not damaged further.

`PRAGMA quick_check` reads every page: 1 GB of readings takes 1 to 2 s from memory and 12 to 30 s from a busy disk, and
a bench waits for its safe state meanwhile. Blocks of readings are nearly all of a large file, and each has a checksum
of its own that is compared whenever it is read. So a large file is checked without them; `labctl check` reads all.
"""

from __future__ import annotations

import sqlalchemy as sa

#: Up to this size every page is checked: some 0.1 s.
WHOLE_UP_TO_BYTES = 64 << 20
READINGS = "sample_blocks"


def first_damage(connection: sa.Connection) -> str:
    """Return the first damage that is found; empty for none. Raises DatabaseError for a file that cannot be read."""
    pages = int(connection.exec_driver_sql("PRAGMA page_count").scalar_one())
    page_bytes = int(connection.exec_driver_sql("PRAGMA page_size").scalar_one())
    if pages * page_bytes <= WHOLE_UP_TO_BYTES:
        return _damage(connection, "PRAGMA quick_check(1)")
    names = connection.exec_driver_sql("SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name").scalars()
    found = (_damage(connection, f"PRAGMA quick_check('{name}')") for name in names.all() if name != READINGS)
    return next(filter(None, found), "")


def _damage(connection: sa.Connection, check: str) -> str:
    text = str(connection.exec_driver_sql(check).scalar() or "ok")
    return "" if text == "ok" else " ".join(text.split())
