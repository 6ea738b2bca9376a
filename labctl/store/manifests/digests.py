"""SHA-256 digests of rows and of the columns of a block of readings, the same on every kind of database."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: The digests of a block, in the order of their columns in `block_digests`.
GROUPS = ("readings", "temperatures", "table_rates")

#: Rows that are encoded together, which takes a fifth of the time.
AT_ONCE = 500


class Hash(Protocol):
    """A hash that takes bytes piece by piece."""

    def update(self, data: bytes, /) -> None:
        """Take more bytes."""

    def hexdigest(self) -> str:
        """Return the digest so far."""
        ...


@dataclass(frozen=True)
class Digest:
    """The digest of a part of a record, and of how many rows it is."""

    sha256: str
    rows: int

    def as_json(self) -> dict[str, object]:
        """Return it as a manifest holds it."""
        return {"sha256": self.sha256, "rows": self.rows}


@dataclass
class RowsDigest:
    """Takes rows of numbers, words, JSON documents and bytes, one after the other; keeps a few of them."""

    rows: int = 0
    _hash: Hash = field(default_factory=hashlib.sha256)
    _waiting: list[Sequence[object]] = field(default_factory=list)

    def take(self, row: Sequence[object]) -> None:
        """Take one row. Raises TypeError for what no database holds."""
        self._waiting.append(tuple(row))
        self.rows += 1
        if len(self._waiting) >= AT_ONCE:
            self._encode()

    def digest(self) -> Digest:
        """Return the digest of all rows so far."""
        self._encode()
        return Digest(self._hash.hexdigest(), self.rows)

    def _encode(self) -> None:
        """Hash the rows as members of one JSON list, each followed by a comma."""
        if self._waiting:
            self._hash.update(_ENCODER.encode(self._waiting)[1:-1].encode() + b",")
            self._waiting.clear()


def digest_of_rows(rows: Iterable[Sequence[object]]) -> Digest:
    """Return the digest of rows in their order; they may come from a cursor."""
    digest = RowsDigest()
    for row in rows:
        digest.take(row)
    return digest.digest()


def _plain(value: object) -> object:
    """Return what JSON can hold: bytes as their digest, a read-only mapping as a dictionary."""
    if isinstance(value, bytes | memoryview):
        return hashlib.sha256(value).hexdigest()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is nothing that a manifest covers")


_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"), default=_plain)


def group_of(column: str) -> str:
    """Return in which digest of a block a column of readings is."""
    if "temperature" in column or column.startswith("chamber"):
        return "temperatures"
    return "table_rates" if "rate_dps" in column or column.startswith("table_") else "readings"


def block_digests(columns: Mapping[str, NDArray[np.generic]]) -> dict[str, str]:
    """Return a digest for each group of the columns (n,) of a block, equal before packing and after unpacking."""
    digests = {group: hashlib.sha256() for group in GROUPS}
    for name in sorted(columns):
        group_digests = digests[group_of(name)]
        group_digests.update(name.encode() + b"\n")
        group_digests.update(_content(columns[name]))
    return {group: each.hexdigest() for group, each in digests.items()}


def _content(values: NDArray[np.generic]) -> bytes | memoryview:
    if values.dtype.kind in "iub":
        return values.astype("int64", order="C", copy=False).data.cast("B") if len(values) else b""
    if values.dtype.kind == "f":
        return values.astype("float64", order="C", copy=False).data.cast("B") if len(values) else b""
    return json.dumps([str(word) for word in values]).encode()
