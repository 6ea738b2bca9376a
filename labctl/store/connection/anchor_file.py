"""A small file beside an SQLite database that holds the end of its chain of manifests.

A chain that was written anew in the database alone does not fit it. The file is written after the commit, so it
may lag behind by what a killed process committed last, but it is always of the same chain.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import sqlalchemy as sa

from labctl.store.connection.private_files import make_private
from labctl.store.manifests.chain import ChainHead
from labctl.store.schema import tables

WIDTH = 12
HASH_LENGTH = 64


def anchor_path(location: str) -> Path:
    """Return the path of a database's anchor file."""
    return Path(f"{location}.anchor")


def write_anchor(location: str, head: ChainHead) -> None:
    """Write the head down, over the one before: the same few bytes, so that a full disk does not matter.

    An anchor that cannot be written fails no commit: it only guards less.
    """
    path = anchor_path(location)
    with contextlib.suppress(OSError):
        make_private(path)
        handle = os.open(path, os.O_WRONLY)
        try:
            os.pwrite(handle, f"{head.length:0{WIDTH}d}:{head.hash}\n".encode(), 0)
        finally:
            os.close(handle)


def read_anchor(location: str) -> ChainHead | None:
    """Return the head that the file holds; None where there is no file. Raises ValueError for one that is damaged."""
    try:
        return parse_anchor(anchor_path(location).read_text(encoding="ascii").strip())
    except OSError:
        return None


def anchor_fits(engine: sa.Engine, location: str) -> bool:
    """Return whether a chain goes on from what its anchor file names; also where there is no chain, or no file."""
    try:
        anchor = read_anchor(location)
    except ValueError:  # it is written anew
        return True
    if anchor is None:
        return True
    m = tables.manifests
    with engine.connect() as connection:
        if not sa.inspect(connection).has_table(m.name):
            return True
        anchored_hash = connection.scalar(sa.select(m.c.hash).where(m.c.sequence == anchor.length))
    return anchored_hash == anchor.hash


def parse_anchor(text: str) -> ChainHead:
    """Read `LENGTH:HASH`. Raises ValueError for any other text."""
    length, _, digest = text.partition(":")
    if not (length.isascii() and length.isdecimal()) or len(digest) != HASH_LENGTH or int(length) < 1:
        raise ValueError(f"{text!r} is not LENGTH:HASH")
    int(digest, 16)
    return ChainHead(int(length), digest)
