"""How fast a unit's errors change from one calibration to the next, for a promise that holds until a date.

The difference of two calibrations of one unit is what the unit drifted by between them, and what both measured wrongly.
Its rate over the years is a quantity with few observations: it is stated with the number of them, by Student's t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from labctl.calibration import Calibration, read_calibration
from labctl.errors import LabctlError
from labctl.fitting.data.channels import BODY_AXES, Channels
from labctl.fitting.models.true_rate_error import errors_at_true_rates
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.combination import LEVEL
from labctl.fitting.uncertainty.vector_bound import PLACES
from labctl.services.calibrations.uncertainty import places_of
from labctl.store import CalibrationRecord, Store

YEAR_S = timedelta(days=365.25).total_seconds()
#: Calibrations closer than this say nothing of the years, s: their difference is that of two measurements.
LEAST_APART_S = timedelta(days=14).total_seconds()
#: How far beyond its limits a version still counts as valid at a place.
MARGIN_SHARE, MARGIN_C = 1e-3, 1.0
NO_HISTORY = "this item has no earlier certified calibration of other measurements, two weeks apart or more"
NOT_COMPARABLE = "its earlier calibrations do not cover all of the range, or have other axes or a model that needs more"


@dataclass(frozen=True)
class Stability:
    """Drift of a unit's errors by place: root mean square over the intervals that are known there."""

    per_year_dps: Array  #: (places,)
    intervals: Array  #: (places,) at least 1

    def expanded_dps(self, years: float) -> float:
        """Return the half width that covers the drift at the worst place over some years, as often as U (GUM G.3)."""
        return float(np.max(self._covering_dps)) * years

    @property
    def worst(self) -> tuple[float, int]:
        """The drift per year, deg/s, and the number of intervals at the place that the half width is of."""
        place = int(np.argmax(self._covering_dps))
        return float(self.per_year_dps[place]), int(self.intervals[place])

    @property
    def _covering_dps(self) -> Array:
        """Half width of the drift of a year, (places,)."""
        return np.asarray(stdtrit(self.intervals, 0.5 * (1.0 + LEVEL)) * self.per_year_dps)


def stability_of(
    store: Store, serial: str, version: int, about: Literal["any axis", "own axis"] = "own axis"
) -> Stability | str:
    """Return the drift that the certified versions of a unit show up to one, or why it is not known.

    About any axis it is that of the errors at rate vectors in many directions. A version that was revoked counts as any
    other: it was measured. Raises NotFound.
    """
    rows = _in_time(store, store.calibrations.get(serial, version))
    if len(rows) < 2:
        return NO_HISTORY
    own = read_calibration(rows[-1][1].document)
    vectors = _vectors(own, about)
    _, temperatures = places_of(own)
    squares = []
    for (before_at, before), (after_at, after) in pairwise(rows):
        years = (after_at - before_at).total_seconds() / YEAR_S
        if (change := _change(before, after, vectors, temperatures)) is not None:
            squares.append((change / years) ** 2)
    if not squares:
        return NOT_COMPARABLE
    every = np.stack(squares)
    known = np.isfinite(every).sum(axis=0)
    if not known.all():
        return NOT_COMPARABLE
    return Stability(np.sqrt(np.nansum(every, axis=0) / known), known)


def years_until(store: Store, row: CalibrationRecord, until: datetime) -> float:
    """Return the years from the measurement of a version to a date; 0 where the date is before it."""
    return max((until - measured_at(store, row)).total_seconds() / YEAR_S, 0.0)


def measured_at(store: Store, row: CalibrationRecord) -> datetime:
    """Return when the newest recording of a version was begun."""
    begun = [datetime.fromisoformat(str(store.recordings.get(n).info["started_at"])) for n in row.recordings]
    return max(begun, default=row.created_at)


def _in_time(store: Store, last: CalibrationRecord) -> list[tuple[datetime, CalibrationRecord]]:
    """Return the certified versions up to one with the times of their measurements, rising; that one is the last.

    Of versions that lie close together, or share a recording with the one before, the first counts.
    """
    certified = {act.version for act in store.calibrations.history(last.serial) if act.act == "certify"}
    end = measured_at(store, last)
    rows = [store.calibrations.get(last.serial, number) for number in sorted(certified - {last.version})]
    timed = sorted(((measured_at(store, row), row) for row in rows), key=lambda each: (each[0], each[1].version))
    kept: list[tuple[datetime, CalibrationRecord]] = []
    for at, row in timed:
        fresh = not kept or (
            (at - kept[-1][0]).total_seconds() >= LEAST_APART_S
            and not set(kept[-1][1].recordings) & set(row.recordings)
        )
        apart = (end - at).total_seconds() >= LEAST_APART_S and not set(last.recordings) & set(row.recordings)
        if fresh and apart:
            kept.append((at, row))
    return [*kept, (end, last)]


def _vectors(calibration: Calibration, about: str) -> list[tuple[Mapping[str, float], Sequence[str]]]:
    """Return the rate vectors at which errors are compared, and the outputs that count at each."""
    rates, _ = places_of(calibration)
    if about == "own axis":
        return [({axis: rate}, (axis,)) for axis in calibration.axes for rate in rates]
    reach, axes = max(map(abs, rates)), calibration.axes
    return [({axis: reach * part for axis, part in zip(BODY_AXES, place, strict=True)}, axes) for place in PLACES]


def _change(
    before: CalibrationRecord, after: CalibrationRecord, vectors: Sequence[tuple[Mapping[str, float], Sequence[str]]],
    temperatures: Sequence[float],
) -> Array | None:  # fmt: skip
    """Return by how much the modelled errors differ at most over the outputs, (temperatures x vectors,) deg/s.

    NaN where one of the versions is not valid; None where they cannot be compared at all.
    """
    both = [read_calibration(row.document) for row in (before, after)]
    if both[0].axes != both[1].axes or any(each.fitted.model.needs for each in both):
        return None
    warm = np.repeat(np.asarray(temperatures, dtype=np.float64), len(vectors))
    rates = {axis: np.tile([rates.get(axis, 0.0) for rates, _ in vectors], len(temperatures)) for axis in BODY_AXES}
    columns = {"temperature_c": warm, "table_rate_dps": np.zeros(len(warm)), "position": np.full(len(warm), "z")}
    try:
        old, new = (errors_at_true_rates(each.fitted, Channels(columns, rates)) for each in both)
    except LabctlError:  # a law that has no inverse there
        return None
    counts = {axis: np.tile([axis in outputs for _, outputs in vectors], len(temperatures)) for axis in both[1].axes}
    change = np.max([np.where(counts[axis], np.abs(new[axis] - old[axis]), 0.0) for axis in both[1].axes], axis=0)
    size = np.linalg.norm(np.stack(list(rates.values())), axis=0)
    inside = np.all([_holds(each, size, warm) for each in both], axis=0)
    return np.where(inside, change, np.nan)


def _holds(calibration: Calibration, size_dps: Array, warm_c: Array) -> NDArray[np.bool_]:
    """Return where a version is valid, (n,); a limit that it does not have is none."""
    (slow, fast), (cold, hot) = calibration.rate_dps, calibration.temperature_c
    valid = np.ones(len(size_dps), dtype=np.bool_)
    if np.isfinite(fast - slow):
        valid &= size_dps <= max(abs(slow), abs(fast)) * (1 + MARGIN_SHARE)
    if np.isfinite(hot - cold):
        valid &= (warm_c >= cold - MARGIN_C) & (warm_c <= hot + MARGIN_C)
    return valid
