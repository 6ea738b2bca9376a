"""How fast a unit's errors change from one calibration to the next, for a promise that holds until a date.

The difference of two calibrations of one unit is what the unit drifted by between them, and what both measured wrongly.
Its rate over the years is a quantity with few observations: it is stated with the number of them, by Student's t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise

import numpy as np
from scipy.special import stdtrit

from labctl.calibration import Calibration, read_calibration
from labctl.errors import LabctlError
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.combination import LEVEL
from labctl.services.calibrations.surface import errors_on_grid
from labctl.services.calibrations.uncertainty import places_of
from labctl.store import CalibrationRecord, Store

YEAR_S = timedelta(days=365.25).total_seconds()
#: Calibrations closer than this say nothing of the years, s: their difference is that of two measurements.
LEAST_APART_S = timedelta(days=14).total_seconds()


@dataclass(frozen=True)
class Stability:
    """Drift of a unit's errors, root mean square over its intervals, at the worst rate and temperature."""

    per_year_dps: float
    intervals: int
    since: datetime  #: of the first calibration that counts

    def expanded_dps(self, years: float) -> float:
        """Return the half width that covers the drift over some years as often as U does (GUM G.3)."""
        return float(stdtrit(self.intervals, 0.5 * (1.0 + LEVEL))) * self.per_year_dps * years


def stability_of(store: Store, serial: str, version: int) -> Stability | None:
    """Return the drift that the certified versions of a unit show up to one; None with less than two of them.

    A version that was revoked counts as any other: it was measured. Raises NotFound.
    """
    rows = _in_time(store, serial, version)
    if len(rows) < 2:
        return None
    own = read_calibration(rows[-1][1].document)
    rates, temperatures = places_of(own)
    squares = []
    for (before_at, before), (after_at, after) in pairwise(rows):
        years = (after_at - before_at).total_seconds() / YEAR_S
        if (change := _change(store, before, after, rates, temperatures)) is not None:
            squares.append((change / years) ** 2)
    if not squares:
        return None
    return Stability(float(np.sqrt(np.mean(squares, axis=0)).max()), len(squares), rows[0][0])


def years_until(store: Store, row: CalibrationRecord, until: datetime) -> float:
    """Return the years from the measurement of a version to a date; 0 where the date is before it."""
    return max((until - measured_at(store, row)).total_seconds() / YEAR_S, 0.0)


def measured_at(store: Store, row: CalibrationRecord) -> datetime:
    """Return when the newest recording of a version was begun."""
    begun = [datetime.fromisoformat(str(store.recordings.get(n).info["started_at"])) for n in row.recordings]
    return max(begun, default=row.created_at)


def _in_time(store: Store, serial: str, version: int) -> list[tuple[datetime, CalibrationRecord]]:
    """Return the certified versions up to one with the times of their measurements, rising; of close ones the last."""
    certified = {act.version for act in store.calibrations.history(serial) if act.act == "certify"} | {version}
    rows = [store.calibrations.get(serial, number) for number in sorted(certified) if number <= version]
    timed = sorted(((measured_at(store, row), row) for row in rows), key=lambda each: (each[0], each[1].version))
    kept: list[tuple[datetime, CalibrationRecord]] = []
    for at, row in timed:
        if kept and (at - kept[-1][0]).total_seconds() < LEAST_APART_S:
            kept.pop()
        kept.append((at, row))
    return kept


def _change(
    store: Store,
    before: CalibrationRecord,
    after: CalibrationRecord,
    rates: Sequence[float],
    temperatures: Sequence[float],
) -> Array | None:
    """Return by how much the modelled errors differ, (axes, rates x temperatures) deg/s; None where they cannot be.

    Only where both versions are valid: a place outside one of them has no change.
    """
    both = [read_calibration(row.document) for row in (before, after)]
    if both[0].axes != both[1].axes:
        return None
    try:
        old, new = (errors_on_grid(store, row, rates, temperatures) for row in (before, after))
    except LabctlError:  # a model that needs a channel which was not recorded, or that has no inverse there
        return None
    inside = np.array([[_holds(each, rate, warm) for each in both] for warm in temperatures for rate in rates])
    if not inside.all(axis=1).any():
        return None
    change = np.array([np.ravel(new[axis]) - np.ravel(old[axis]) for axis in both[1].axes])
    return np.where(inside.all(axis=1), change, 0.0)


def _holds(calibration: Calibration, rate_dps: float, temperature_c: float) -> bool:
    (slow, fast), (cold, hot) = calibration.rate_dps, calibration.temperature_c
    is_fast = np.isfinite(fast - slow) and not slow - 1e-6 <= rate_dps <= fast + 1e-6
    is_warm = np.isfinite(hot - cold) and not cold - 1.0 <= temperature_c <= hot + 1.0
    return not (is_fast or is_warm)
