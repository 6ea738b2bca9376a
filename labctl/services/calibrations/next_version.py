"""Keeping a calibration as a unit's next version: built with its number, before the transaction that keeps it."""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import datetime

from labctl.errors import VersionTaken
from labctl.store import CalibrationRecord, NewCalibration, Store

#: How many other fits may take the number in turn before this one gives up.
TRIES = 20


def refuse_taken(store: Store, serial: str, expected: int | None) -> None:
    """Raise VersionTaken where a unit's next version has another number than the one that a request expects."""
    number = store.calibrations.next_version(serial)
    if expected is None or expected == number:
        return
    if expected > number:
        raise VersionTaken(f"{serial} version {expected} cannot be made: its next version is {number}; expect that one")
    known = store.calibrations.get(serial, expected)
    parent = "by a fit" if known.parent is None else f"from version {known.parent}"
    raise VersionTaken(
        f"{serial} version {expected} exists already: {known.model}, made {parent} at "
        f"{known.created_at:%Y-%m-%d %H:%M} UTC; inspect it, or make version {number} beside it"
    )


def keep_next_version(
    store: Store, serial: str, at: datetime, build: Callable[[int], NewCalibration], expected: int | None = None
) -> CalibrationRecord:
    """Build a calibration with a unit's next number and keep it, again where another fit was quicker.

    With `expected` it is kept only under this number. Raises VersionTaken where that is taken, and when others were
    quicker all the time.
    """
    for _ in range(TRIES - 1):
        refuse_taken(store, serial, expected)
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
