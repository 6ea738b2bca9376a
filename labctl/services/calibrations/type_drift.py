"""How fast the errors of other units of the same model change, for a unit without a history of its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import groupby

import numpy as np

from instruments.standards import SIMULATED
from labctl.calibration import Calibration
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.drift_prediction import MIN_UNITS, DriftPrediction, of_type
from labctl.services.benches.bench_clock import has_simulated_instrument
from labctl.services.calibrations.certified_intervals import calibrations_of, rates_of, versions_apart
from labctl.services.calibrations.error_grid import ErrorGrid
from labctl.store import CertifiedVersion, Store

#: Calibrations of other units closer than this say more of two measurements than of the years.
MIN_INTERVAL = timedelta(days=90)
#: Units of a model that are evaluated, those first that were certified last, and versions of each, the newest: what a
#: certificate takes does not grow with the fleet.
MAX_UNITS, MAX_VERSIONS = 40, 5
NO_MODEL = "the model of the item is not stated, so that it has no type"
NEVER = datetime.min.replace(tzinfo=UTC)
TOO_FEW = (
    "of its model, {model}, {units} other {noun} certified calibrations of the same outputs, {days} days apart or "
    "more, that cover all of the range; the drift of a type takes {least}"
)


@dataclass(frozen=True)
class TypeDrift:
    """The drift of a unit that is drawn from those of its model, by place, and what it was evaluated from."""

    predicted: DriftPrediction
    model: str
    units: int  #: at the place with the fewest
    over_years: tuple[float, float]  #: shortest and longest history of a unit


@dataclass(frozen=True)
class _History:
    """Changes of one unit."""

    rates_dps: Array  #: (intervals, places) per year
    years: Array  #: (intervals,)


def drift_of_type(
    store: Store, version: CertifiedVersion, calibration: Calibration, grid: ErrorGrid
) -> TypeDrift | str:
    """Return the drift of the type of a unit on a grid, or why it is not known; the unit itself is left out.

    The type is the model of the unit, letter by letter. Simulated units are a type of their own. The grid is that of
    `version`, whose content is `calibration`.
    """
    model = store.units.get(version.serial).model
    if not model.strip():
        return NO_MODEL
    every = _histories(store, version, calibration, model, grid)
    grids = [each for each in every if np.isfinite(each.rates_dps).any()]
    units = int(np.min(np.sum([np.isfinite(each.rates_dps).any(axis=0) for each in grids], axis=0))) if grids else 0
    if units < MIN_UNITS:
        noun = "unit has" if units == 1 else "units have"
        return TOO_FEW.format(model=model, units=units or "no", noun=noun, days=MIN_INTERVAL.days, least=MIN_UNITS)
    most = max(len(each.years) for each in grids)
    rates = np.full((len(grids), most, grids[0].rates_dps.shape[1]), np.nan)
    years = np.zeros((len(grids), most))
    for row, each in enumerate(grids):
        rates[row, : len(each.years)], years[row, : len(each.years)] = each.rates_dps, each.years
    spans = years.sum(axis=1)
    return TypeDrift(of_type(rates, years), model, units, (float(spans.min()), float(spans.max())))


def _histories(
    store: Store, latest: CertifiedVersion, calibration: Calibration, model: str, grid: ErrorGrid
) -> Iterator[_History]:
    """Yield the changes of each other unit of a model that was as real, or as simulated, as the unit itself."""
    chosen = list(_chosen(store.certified_versions.of_model(model, latest.serial)))
    every = [version for unit in chosen for version in unit]
    calibrations = calibrations_of(store, every)
    campaigns = frozenset[int]().union(latest.campaigns, *(each.campaigns for each in every))
    simulated = {
        number: has_simulated_instrument(bench) for number, bench in store.certified_versions.benches(campaigns).items()
    }
    is_wanted = _is_simulated(latest, calibration, simulated)
    for unit in chosen:
        if all(_is_simulated(each, calibrations[each.id], simulated) == is_wanted for each in unit):
            yield _History(*rates_of(unit, calibrations, grid))


def _chosen(versions: Sequence[CertifiedVersion]) -> Iterator[list[CertifiedVersion]]:
    """Yield the newest versions of each unit that has several far enough apart, up to the number of units."""
    units = 0
    for _, every in groupby(versions, key=lambda version: version.serial):
        of_unit = [each for each in every if each.measured_at is not None]
        if not of_unit:
            continue
        last = max(of_unit, key=lambda each: (each.measured_at or NEVER, each.version))
        apart = versions_apart(of_unit, last, MIN_INTERVAL)[-MAX_VERSIONS:]
        if len(apart) > 1 and units < MAX_UNITS:
            units += 1
            yield apart


def _is_simulated(version: CertifiedVersion, calibration: Calibration, simulated: Mapping[int, bool]) -> bool:
    """Return whether a version was measured on a simulated bench: by its campaigns, or by its standards."""
    standards = () if calibration.bench is None else calibration.bench.standards
    return any(simulated.get(number, False) for number in version.campaigns) or (
        any(standard.traceability == SIMULATED for standard in standards)
    )
