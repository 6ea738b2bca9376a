"""Leases: who may drive which bench. One row per bench; taking it over compares and swaps in one transaction."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from datetime import datetime

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.connection.writer_lock import ServiceAddress
from labctl.store.repositories.records_by_name import record_of, records_of
from labctl.store.schema import tables


@dataclass(frozen=True)
class LeaseRow:
    """Who holds a bench. `machine` names the place where `pid` means something; empty when that is not known."""

    bench_name: str
    owner: str  #: one for each time that a bench is held
    host: str
    machine: str
    pid: int
    since: datetime
    beat: int  #: counts renewals: a lease that lives is one whose beat changes
    beat_at: datetime
    expires_at: datetime
    url: str | None = None  #: of the service that drives the bench
    calls: str | None = None  #: folder of the Unix sockets of its bench process


class Leases:
    """The leases on the benches of one database."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @property
    def address(self) -> ServiceAddress:
        """Where this process is reached, for the leases that it takes."""
        return self._database.address

    def all(self) -> list[LeaseRow]:
        """Return every lease, by the name of its bench; also those of processes that are gone."""
        x = tables.leases.c
        query = sa.select(*(x[field.name] for field in fields(LeaseRow))).order_by(x.bench_name)
        with self._database.reading() as connection:
            return records_of(LeaseRow, connection.execute(query))

    def holder(self, bench_name: str) -> LeaseRow | None:
        """Return who holds a bench; None when it is free."""
        x = tables.leases.c
        query = sa.select(*(x[field.name] for field in fields(LeaseRow))).where(x.bench_name == bench_name)
        with self._database.reading() as connection:
            row = connection.execute(query).mappings().first()
        return None if row is None else record_of(LeaseRow, row)

    @transaction
    def claim(self, lease: LeaseRow, replacing: LeaseRow | None) -> bool:
        """Take a bench that is free, or from the holder `replacing` as it was seen; False when that changed."""
        x = tables.leases
        try:
            with self._database.writing() as connection:
                if replacing is None:
                    connection.execute(sa.insert(x).values(**asdict(lease)))
                    return True
                is_unchanged = (
                    x.c.bench_name == lease.bench_name,
                    x.c.owner == replacing.owner,
                    x.c.beat == replacing.beat,
                )
                return connection.execute(sa.update(x).where(*is_unchanged).values(**asdict(lease))).rowcount == 1
        except exc.IntegrityError:
            return False

    @transaction
    def renew(self, bench_name: str, owner: str, at: datetime, expires_at: datetime) -> bool:
        """Prolong a lease; False when it is no longer the owner's."""
        x = tables.leases
        mine = sa.update(x).where(x.c.bench_name == bench_name, x.c.owner == owner)
        with self._database.writing(synced=False) as connection:
            changed = connection.execute(mine.values(beat=x.c.beat + 1, beat_at=at, expires_at=expires_at))
        return changed.rowcount == 1

    @transaction
    def note_address(self, machine: str, pid: int) -> None:
        """Write into the leases of a process where its service is reached now."""
        x, address = tables.leases, self._database.address
        with self._database.writing() as connection:
            mine = sa.update(x).where(x.c.machine == machine, x.c.pid == pid)
            connection.execute(mine.values(url=address.url, calls=address.calls))

    @transaction
    def release(self, bench_name: str, owner: str) -> None:
        """Release a bench; nothing happens when the lease is another's by now."""
        x = tables.leases
        with self._database.writing() as connection:
            connection.execute(sa.delete(x).where(x.c.bench_name == bench_name, x.c.owner == owner))
