"""Signing, after the fact: a thread signs the end of the chain; a token that hangs delays nothing that is written.

A signature over a manifest vouches for all before it, so only the last one is signed when several were added meanwhile.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import closing

import sqlalchemy as sa

from labctl.errors import LabctlError, StoreError
from labctl.log import get_logger
from labctl.store.connection.database import Database
from labctl.store.manifests import chain
from labctl.store.manifests.chain import ChainHead
from labctl.store.schema import tables
from labctl.store.sealing.signers import Signer, signer_of

#: How long a process that ends waits for its last signature, s.
LAST_SIGNATURE_S = 2.0

log = get_logger()


class Signing:
    """Signs what is added to the chain of a database while it is open."""

    def __init__(self, database: Database, open_signer: Callable[[], Signer]) -> None:
        """Sign from now on; the end of the chain too, where an earlier process left it without a signature."""
        self._database = database
        self._open_signer = open_signer
        self._signer: Signer | None = None
        self._changed = threading.Condition()
        self._writing = threading.Lock()
        self._due: ChainHead | None = unsigned_head(database)
        self._over = self._closed = False
        database.on_growth = self._take
        self._thread = threading.Thread(target=self._run, name="signing", daemon=True)
        self._thread.start()

    def _take(self, head: ChainHead) -> None:
        with self._changed:
            self._due = head
            self._changed.notify()

    def _run(self) -> None:
        while (head := self._next()) is not None:
            try:
                self._signer = self._signer or self._open_signer()
                self._keep(head, self._signer)
            except (LabctlError, OSError) as error:  # it stays without, which the check says; the next one covers it
                log.warning("manifest.not_signed", sequence=head.length, error=str(error))

    def _next(self) -> ChainHead | None:
        with self._changed:
            self._changed.wait_for(lambda: self._due is not None or self._over)
            due, self._due = self._due, None
            return due

    def _keep(self, head: ChainHead, signer: Signer) -> None:
        signature = signer.sign(head.hash)
        with self._writing:
            if not self._closed:  # the database is another process's by now
                keep_signature(self._database, head, signature, signer)

    def close(self) -> None:
        """Sign what is due, and end; a signature that takes longer than 2 s is left out."""
        self._database.on_growth = None
        with self._changed:
            self._over = True
            self._changed.notify()
        self._thread.join(LAST_SIGNATURE_S)
        with self._writing:
            self._closed = True


def begin_signing(database: Database, setting: str) -> Signing | None:
    """Sign with the key that the setting names; None where none is set."""
    return Signing(database, lambda: signer_of(setting)) if setting else None


def unsigned_head(database: Database) -> ChainHead | None:
    """Return the end of a chain that has no signature; None where it has one, or does not fit its anchor file."""
    m = tables.manifests.c
    with database.reading() as connection:
        head = chain.last(connection)
        signature = connection.scalar(sa.select(m.signature).where(m.sequence == head.length))
    return head if head.length and signature is None and database.anchor_fits else None


def keep_signature(database: Database, head: ChainHead, signature: bytes, signer: Signer) -> None:
    """Write a signature beside its manifest. Raises StoreError."""
    m = tables.manifests
    same = (m.c.sequence == head.length, m.c.hash == head.hash)
    with database.writing() as connection:
        signed = {"signature": signature, "signed_by": signer.public.fingerprint}
        connection.execute(sa.update(m).where(*same).values(**signed))


def sign_chain(database: str, setting: str) -> ChainHead | None:
    """Sign the end of a chain now; returns what was signed, None where it is signed already.

    Raises BadInput for a key that cannot be used, Conflict while another process holds the database.
    """
    signer = signer_of(setting)
    with closing(Database(database, write=True)) as opened:
        head = unsigned_head(opened)
        if head is not None:
            keep_signature(opened, head, signer.sign(head.hash), signer)
        elif not opened.anchor_fits:
            raise StoreError(
                f"{database}: the chain does not fit its anchor file; run `labctl check`; nothing was signed"
            )
    return head
