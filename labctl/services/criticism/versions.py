"""Calibration versions of a unit, by number."""

from __future__ import annotations

from labctl.errors import BadInput
from labctl.store import CalibrationRecord, Store


def version_of(store: Store, serial: str, version: int | None) -> CalibrationRecord:
    """Return a version, or the newest. Raises NotFound, BadInput where there is none yet."""
    rows = store.calibrations.of_unit(store.units.get(serial).serial)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    if version is None:
        return max(rows, key=lambda row: row.version)
    return store.calibrations.get(serial, version)
