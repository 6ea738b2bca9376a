"""Canonical JSON: the parts around a hash are written as the whole would be, and the hash covers all but itself."""

from __future__ import annotations

import hashlib
import json
from typing import Any

import pytest

from labctl.canonical_json import canonical, canonical_and_hash, hash_of, with_own_hash


@pytest.mark.parametrize(
    "document",
    [
        {"hash": "old", "a": 1.5, "z": [None, "µ"]},
        {"hash": "old", "hasha": 1, "hasi": 2, "has": 3, "Hash": 4},
        {"hash": "old"},
        {"a": {"hash": "inner"}},
        {"z": 1},
        {},
    ],
)
def test_the_parts_are_written_as_the_whole(document: dict[str, Any]) -> None:
    rest = {key: value for key, value in document.items() if key != "hash"}
    plain = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=False).encode()
    expected = hashlib.sha256(plain).hexdigest()
    assert hash_of(document) == expected
    assert canonical_and_hash(document) == (canonical(document), expected)
    assert with_own_hash(document) == (canonical({**rest, "hash": expected}), expected)
