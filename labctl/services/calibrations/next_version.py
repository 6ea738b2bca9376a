"""Keeping a calibration as a unit's next version: built with its number, before the transaction that keeps it."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import datetime

from labctl.errors import VersionTaken
from labctl.store import CalibrationRecord, NewCalibration, Store

#: How many other fits may take the number in turn before this one gives up.
TRIES = 20


def keep_next_version(
    store: Store, serial: str, at: datetime, build: Callable[[int], NewCalibration]
) -> CalibrationRecord:
    """Build a calibration with a unit's next number and keep it, again where another fit was quicker.

    Raises VersionTaken when others were quicker all the time.
    """
    for _ in range(TRIES - 1):
        version = store.calibrations.next_version(serial)
        try:
            return store.calibrations.add(serial, at, version, build(version))
        except VersionTaken:
            continue
    version = store.calibrations.next_version(serial)
    return store.calibrations.add(serial, at, version, build(version))


def answer_of(row: CalibrationRecord) -> dict[str, object]:
    """Return what was kept of the fit of a version, with the nominal output of each axis, which its document states."""
    return {**row.answer, "output": json.loads(row.document)["output"]}
