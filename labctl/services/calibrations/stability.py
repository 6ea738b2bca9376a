"""How fast a unit's errors change from one calibration to the next, for a promise that holds until a date.

The difference of two calibrations of one unit is what the unit drifted by between them, and what both measured wrongly.
Its rate over the years is a quantity with few observations: it is stated with the number of them, by Student's t. A
unit without a history of its own drifts as a unit that is drawn from those of its model.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from labctl.calibration import read_calibration
from labctl.fitting.uncertainty.drift_prediction import DriftPrediction, of_item, with_drift
from labctl.recording.info import GIVE_DATE, measured_at
from labctl.services.calibrations.certified_intervals import YEAR_S, calibrations_of, rates_of, versions_apart
from labctl.services.calibrations.error_grid import About, ErrorGrid
from labctl.services.calibrations.type_drift import TypeDrift, drift_of_type
from labctl.store import CalibrationRecord, CertifiedVersion, Store

#: Calibrations of a unit closer than this say nothing of the years: their difference is that of two measurements.
MIN_INTERVAL = timedelta(days=14)
#: Intervals at each place from which on a unit's own history suffices, whatever is known of its type.
MIN_INTERVALS = 2
NO_HISTORY = "this item has no earlier certified calibration of other measurements, two weeks apart or more"
NOT_COMPARABLE = "its earlier calibrations do not cover all of the range, or have other axes or a model that needs more"


@dataclass(frozen=True)
class Stability:
    """Drift of a unit's errors in a year to come, by place, and where it is known from."""

    predicted: DriftPrediction
    intervals: int  #: between calibrations of the unit itself, at the place with the fewest
    of_type: TypeDrift | None = None  #: None: from the unit's own history

    def expanded_about_mean_dps(self, years: float) -> float:
        """Return the half width about the mean at the worst place over some years (GUM G.3)."""
        return float(np.max(self.predicted.expanded_about_mean_dps)) * years

    def mean_dps(self, years: float) -> float:
        """Return the size of the expected drift at the worst place over some years; 0 by a unit's own history."""
        return float(np.max(np.abs(self.predicted.mean_dps))) * years

    def expanded_dps(self, years: float) -> float:
        """Return the half width that covers the drift at the worst place over some years, as often as U."""
        return with_drift(0.0, self.expanded_about_mean_dps(years), self.mean_dps(years))

    @property
    def worst(self) -> tuple[float, float]:
        """Standard uncertainty of the drift per year, deg/s, and its degrees of freedom, where the spread is largest.

        By a unit's own history they are the root mean square and the number of the intervals.
        """
        place = int(np.argmax(self.predicted.expanded_about_mean_dps))
        return float(self.predicted.u_dps[place]), float(self.predicted.freedom[place])


def stability_of(store: Store, serial: str, version: int, about: About = "own axis") -> Stability | str:
    """Return the drift of a unit by its certified versions up to one, or else by its type; or why it is not known.

    About any axis it is that of the errors at rate vectors in many directions. A version that was revoked counts as any
    other: it was measured. A single interval of its own suffices where the type is not known, or where the unit changed
    more than the type does. Raises NotFound.
    """
    certified = store.certified_versions.of_unit(serial, version)
    last = next((each for each in certified if each.version == version), None)
    if last is not None and last.measured_at is None:
        return f"the date of its measurement is not known; {GIVE_DATE}"
    calibration = read_calibration(store.calibrations.get(serial, version).document)
    assert last is not None
    grid = ErrorGrid.of(calibration, about)
    of_unit = _own(store, versions_apart(certified, last, MIN_INTERVAL), grid)
    if isinstance(of_unit, Stability) and of_unit.intervals >= MIN_INTERVALS:
        return of_unit
    drift = drift_of_type(store, last, calibration, grid)
    if isinstance(drift, str):
        return f"{of_unit}; {drift}" if isinstance(of_unit, str) else of_unit
    if isinstance(of_unit, Stability) and not _is_typical(of_unit, drift.predicted):
        return of_unit
    return Stability(drift.predicted, of_unit.intervals if isinstance(of_unit, Stability) else 0, drift)


def _own(store: Store, versions: list[CertifiedVersion], grid: ErrorGrid) -> Stability | str:
    """Return the drift by a unit's own versions, or why it is not known."""
    if len(versions) < 2:
        return NO_HISTORY
    rates, years = rates_of(versions, calibrations_of(store, versions), grid)
    if not len(years) or not np.isfinite(rates).any(axis=0).all():
        return NOT_COMPARABLE
    predicted = of_item(rates)
    return Stability(predicted, int(np.min(predicted.freedom)))


def _is_typical(of_unit: Stability, of_type: DriftPrediction) -> bool:
    """Return whether the root mean square of a unit's own drift is within what its type predicts, at every place."""
    within = np.abs(of_type.mean_dps) + of_type.expanded_about_mean_dps
    return bool(np.all(of_unit.predicted.u_dps <= within))


def years_until(measured: datetime, until: datetime) -> float:
    """Return the years from the measurement of a version to a date; 0 where the date is before it."""
    return max((until - measured).total_seconds() / YEAR_S, 0.0)


def version_measured_at(store: Store, row: CalibrationRecord) -> datetime | None:
    """Return when the newest recording of a version was begun; None where one of them has no date."""
    begun = [measured_at(store.recordings.get(n).info) for n in row.recordings]
    begin_times = [each for each in begun if each is not None]
    return max(begin_times, default=row.created_at) if len(begin_times) == len(begun) else None
