"""What a promise of a certificate that holds until a date contains of drift, and how that is said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime, time

from labctl.certificates.document import ResultPoint, StabilityResult, TypeOfItem
from labctl.fitting.uncertainty.drift_prediction import with_drift
from labctl.services.calibrations.stability import Stability, stability_of, version_measured_at, years_until
from labctl.services.certificates.facts import Facts
from labctl.store import Store

NOW = "The uncertainties hold at the time of the calibration."
OF_ITEM = (
    "By {intervals} between calibrations, the errors of this item change by {per_year:.3g} °/s per year (root mean "
    "square at the worst place, {turned}): until {until} by {drift:.3g} °/s at most (95.45 %, Student's t)."
)
OF_TYPE = (
    "The drift of this item is not known from calibrations of its own{single}. By the drift of {units} other units of "
    "model {model} over {shortest:.1f} to {longest:.1f} years, the errors of a unit of this model change by "
    "{mean:.3g} °/s per year on average, and those of a single unit differ from that by {per_year:.3g} °/s per year "
    "(standard uncertainty of a prediction, {freedom:.3g} degrees of freedom; each at the worst place, {turned}): "
    "until {until} by {drift:.3g} °/s at most (95.45 %, Student's t)."
)
#: Where the item has an interval, which is too few to evaluate.
SINGLE = " (its one interval between calibrations is within what follows)"


def stability_until(store: Store, facts: Facts, until: datetime) -> StabilityResult:
    """Return what the item is expected to drift by until a date: by its own history, by its type, or unknown."""
    about = "own axis" if facts.order.conformity is None else facts.order.conformity.about
    stability = stability_of(store, facts.row.serial, facts.row.version, about)
    years = years_until(_measured(store, facts), until)
    if isinstance(stability, str):
        return StabilityResult(
            until=until.date(), years=years, per_year_dps=None, intervals=0, drift_dps=None, about=about, why=stability
        )
    per_year, freedom = stability.worst
    return StabilityResult(
        until=until.date(), years=years, per_year_dps=per_year,
        intervals=round(freedom) if stability.of_type is None else stability.intervals,
        drift_dps=stability.expanded_dps(years),
        about=about, type=_type(stability, years),
    )  # fmt: skip


def _measured(store: Store, facts: Facts) -> datetime:
    """Return when a version was measured: by its recordings, else by the order, without which nothing is issued."""
    measured_at = version_measured_at(store, facts.row)
    if measured_at is None and facts.performed_until is not None:
        return datetime.combine(facts.performed_until, time(), UTC)
    return measured_at or facts.row.created_at


def _type(known: Stability, years: float) -> TypeOfItem | None:
    if known.of_type is None:
        return None
    return TypeOfItem(
        model=known.of_type.model, units=known.of_type.units, over_years=known.of_type.over_years,
        mean_per_year_dps=known.mean_dps(1.0), freedom=known.worst[1],
        expanded_about_mean_dps=known.expanded_about_mean_dps(years),
    )  # fmt: skip


def until_date(expanded_dps: float, stability: StabilityResult | None) -> float:
    """Return an expanded uncertainty with the drift until the date that is stated, deg/s; itself without one.

    The mean drift of a type is a known error that no rate is corrected for.
    """
    if stability is None or stability.drift_dps is None or not math.isfinite(expanded_dps):
        return expanded_dps
    if stability.type is None:
        return math.hypot(expanded_dps, stability.drift_dps)
    mean = stability.type.mean_per_year_dps * stability.years
    return with_drift(expanded_dps, stability.type.expanded_about_mean_dps, mean)


def until(stability: StabilityResult | None, results: Sequence[ResultPoint]) -> tuple[str, ...]:
    """Return what U is until the date of the next calibration; nothing where no date is stated."""
    if stability is None:
        return ()
    if stability.drift_dps is None:
        text = (
            f"{NOW} What the item drifts by until {stability.until} is not known, and they do not contain it: "
            f"{stability.why}."
        )
        return (text,)
    largest = until_date(max((point.expanded_dps for point in results), default=0.0), stability)
    return (f"{NOW} {_drift(stability)} With it, the largest U of the results is {largest:.3g} °/s.",)


def _drift(stability: StabilityResult) -> str:
    """Return in words what the drift is known from."""
    motion_text = "turned about any axis" if stability.about == "any axis" else "turned about the axis of one output"
    intervals = f"{stability.intervals} {'interval' if stability.intervals == 1 else 'intervals'}"
    figures = {
        "per_year": stability.per_year_dps, "turned": motion_text, "until": stability.until,
        "drift": stability.drift_dps,
    }  # fmt: skip
    if stability.type is None:
        return OF_ITEM.format(intervals=intervals, **figures)
    shortest, longest = stability.type.over_years
    return OF_TYPE.format(
        single=SINGLE if stability.intervals else "", units=stability.type.units, model=stability.type.model,
        shortest=shortest, longest=longest, mean=stability.type.mean_per_year_dps, freedom=stability.type.freedom,
        **figures,
    )  # fmt: skip
