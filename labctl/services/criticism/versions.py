"""Calibration versions of a unit, by number."""

from __future__ import annotations

import hashlib
import json

from labctl.errors import BadInput
from labctl.store import CalibrationRecord, Store


def version_of(store: Store, serial: str, version: int | None) -> CalibrationRecord:
    """Return a version, or the newest. Raises NotFound, BadInput where there is none yet."""
    rows = store.calibrations.of_unit(store.units.get(serial).serial)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first version")
    if version is None:
        return max(rows, key=lambda row: row.version)
    return store.calibrations.get(serial, version)


def content_digest(row: CalibrationRecord) -> str:
    """Return a digest of a version's file without the instant of its issue, on which no criticism depends.

    The hash of the file itself differs from fit to fit, even of the same recording.
    """
    content = {key: value for key, value in json.loads(row.document).items() if key not in {"issued_at", "hash"}}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
