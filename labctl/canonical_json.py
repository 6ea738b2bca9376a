"""Canonical JSON, and documents that hold the hash of themselves: one way to write each document, byte by byte."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from labctl.answers.json_object import JsonObject

_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def canonical(document: JsonObject) -> bytes:
    """Return the one way to write a document: sorted keys, no spaces, UTF-8, shortest exact numbers."""
    return _ENCODER.encode(document).encode()


def hash_of(document: JsonObject) -> str:
    """Return the SHA-256 of everything in a document but its hash."""
    return hashlib.sha256(_joined(*_around_hash(document))).hexdigest()


def canonical_and_hash(document: JsonObject) -> tuple[bytes, str]:
    """Return `canonical` and `hash_of` of a document, written once for both."""
    before, after = _around_hash(document)
    hash_entry = canonical({"hash": document["hash"]})[1:-1] if "hash" in document else b""
    return _joined(before, hash_entry, after), hashlib.sha256(_joined(before, after)).hexdigest()


def with_own_hash(document: JsonObject) -> tuple[bytes, str]:
    """Return a document with the hash of itself in canonical form, and the hash; one that it has is replaced."""
    before, after = _around_hash(document)
    digest = hashlib.sha256(_joined(before, after)).hexdigest()
    return _joined(before, canonical({"hash": digest})[1:-1], after), digest


def _around_hash(document: JsonObject) -> tuple[bytes, bytes]:
    """Return the canonical members of a document before and after its hash."""
    before = canonical({key: value for key, value in document.items() if key < "hash"})
    after = canonical({key: value for key, value in document.items() if key > "hash"})
    return before[1:-1], after[1:-1]


def _joined(*members: bytes) -> bytes:
    return b"{" + b",".join(part for part in members if part) + b"}"
