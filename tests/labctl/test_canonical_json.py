"""Canonical JSON: the parts around a hash are written as the whole would be, and the hash covers all but itself."""

from __future__ import annotations

import hashlib
import json
from datetime import UTC, datetime
from typing import Any

import pytest

from labctl.calibration import Calibration, read_calibration
from labctl.calibration.certification import Certification, with_certification
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


def certified(document: dict[str, Any]) -> tuple[bytes, bytes]:
    """Return a calibration file with a certification as it is served, and written anew."""
    content, digest = with_own_hash(document)
    certification = Certification(
        "in-force", 'Ann "µ"', 'says "hash":"' + digest + '",', datetime(2026, 1, 5, tzinfo=UTC), None, digest
    )
    served, found = with_certification(content + b"\n", certification)
    anew, expected = with_own_hash({**json.loads(content), "certification": certification.to_json()})
    assert found == expected
    return served, anew + b"\n"


@pytest.mark.parametrize(
    "document",
    [
        {"axes": ["z"], "coefficients": {"z": 1.5e-9}, "serial": "µ", "hash": "", "version": 1},
        {"certification": {"state": "revoked"}, "hash": "", "version": 1},
        {"axes": [], "hash": ""},
        {"version": 1},
        {"certificate": 1, "certifications": {"certification": []}, "hash": "", "z": '"hash":"'},
    ],
)
def test_a_certification_is_inserted_as_if_the_whole_were_written_anew(document: dict[str, Any]) -> None:
    served, anew = certified(document)
    assert served == anew


def test_real_calibrations_are_certified_without_being_read(fog: Calibration, mems: Calibration) -> None:
    for calibration in (fog, mems):
        served, anew = certified(dict(calibration.document))
        assert served == anew
        assert read_calibration(served).calibration_hash == calibration.hash
