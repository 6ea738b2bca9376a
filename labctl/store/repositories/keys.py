"""API keys: names, roles, and digests of keys; the keys themselves are not stored."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from functools import cache
from typing import Any

import sqlalchemy as sa

from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.lookup import Lookup, one_of_keys
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import KEY
from labctl.store.records import KeyRow
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables
from labctl.store.sealing.seals import changing, seal

_k = tables.api_keys.c
_ALL = sa.select(_k.name, _k.role, _k.digest, _k.created_at, _k.revoked_at)


@cache
def _by_digest(*, is_shared: bool) -> sa.Select[*tuple[Any, ...]]:
    """Return the query behind every request that carries a key."""
    return _ALL.where(one_of_keys(_k.digest, is_shared=is_shared))


class Keys:
    """Every key that was ever made; a revoked one stays, without power."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def add(self, name: str, role: str, digest: str, at: datetime) -> KeyRow:
        """Keep a new key's digest. Raises Conflict when the name was used before."""
        with self._database.writing() as connection:
            if connection.scalar(sa.select(_k.name).where(_k.name == name)) is not None:
                raise Conflict(
                    f"a key with the name {name!r} exists or existed, and a name is used only once; choose another name"
                )
            connection.execute(
                sa.insert(tables.api_keys).values(name=name, role=role, digest=digest, created_at=at, revoked_at=None)
            )
            append(connection, at, "key create", f"key {name}", {"role": role})
            seal(connection, (KEY.name, name), at, "made")
        return KeyRow(name, role, digest, at, None)

    @transaction
    def revoke(self, name: str, reason: str, at: datetime) -> KeyRow:
        """Revoke a key, at once. Raises NotFound, Conflict when it was revoked before."""
        with self._database.writing() as connection:
            row = connection.execute(_ALL.where(_k.name == name)).first()
            if row is None:
                raise NotFound(f"there is no key {name!r}; `labctl key list` shows the keys")
            if row.revoked_at is not None:
                raise Conflict(
                    f"key {name!r} was already revoked at {row.revoked_at.isoformat()}; no further action is needed"
                )
            with changing(connection, [(KEY.name, name)], at, "revoked"):
                connection.execute(sa.update(tables.api_keys).where(_k.name == name).values(revoked_at=at))
                append(connection, at, "key revoke", f"key {name}", {"role": row.role, "reason": reason})
        return KeyRow(row.name, row.role, row.digest, row.created_at, at)

    def all(self) -> list[KeyRow]:
        """Return every key, by name."""
        with self._database.reading() as connection:
            return records_of(KeyRow, connection.execute(_ALL.order_by(_k.name)))

    def lookup(self) -> Lookup:
        """Return the reads of keys by their digests, for `keys_by_digests`."""
        return self._database.lookup(_by_digest(is_shared=self._database.is_shared))


async def keys_by_digests(lookup: Lookup, digests: Sequence[str]) -> dict[str, KeyRow]:
    """Return digest -> key, in force or not, where there is one. Raises StoreError."""
    rows = await lookup.rows(digests)
    return {row.digest: KeyRow(row.name, row.role, row.digest, row.created_at, row.revoked_at) for row in rows}
