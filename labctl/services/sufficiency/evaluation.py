"""U of a campaign's fit over the range of its recipe's [stop], by the data sets that are complete so far."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.answers.sufficiency import Known
from labctl.errors import LabctlError
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.over_range import LargestU, Range, data_and_preset, lack_of_fit, largest_u, least_u
from labctl.recording import Recording
from labctl.recording.verification import is_marked
from labctl.services.sufficiency.running_points import RunningPoints
from labctl.store import Store
from procedures.planning.plan import Plan
from procedures.recipe.recipe import Recipe
from procedures.recipe.stop_rules import StopRules

#: A campaign is evaluated about so often at most: after each data set of a plan with so many, else at equal distances.
MAX_EVALUATIONS = 100
#: A set point, and a share of the fastest rate, by which a data set may be off the end of the range.
NEAR_C, NEAR_SHARE = 0.15, 0.01


@dataclass(frozen=True)
class UnitU:
    """U of one unit after so many data sets."""

    gyro: str
    datasets: int  #: that are fitted
    known: Known
    u_dps: float | None
    axis: str = ""
    rate_dps: float = 0.0
    temperature_c: float = 0.0
    why: str = ""  #: why U is unknown, or why the campaign cannot end yet
    more_sets: int | None = None  #: at that place, which would bring U there to the limit; None: no number of them does
    model_share: float = 0.0  #: of the variance there, the part of what the model leaves at data sets it has not seen

    def reaches(self, limit_dps: float) -> bool:
        """Return whether U is known over the whole range, small enough, and not too small for want of a right model."""
        return self.known == "of the fit" and self.u_dps is not None and self.u_dps <= limit_dps and not self.why


class Evaluation:
    """Evaluates one campaign again and again, from the database alone: another process finds the same."""

    def __init__(self, store: Store, campaign: int) -> None:
        row = store.campaigns.get(campaign)
        self._store, self._campaign = store, campaign
        recipe = Recipe.model_validate(dict(row.recipe))
        assert recipe.stop is not None
        plan = Plan.model_validate({"recipe": recipe, "steps": [step.body for step in store.campaigns.steps(campaign)]})
        self._recipe, self._rules = recipe, recipe.stop
        self._every = math.ceil(plan.fitted_datasets / MAX_EVALUATIONS)
        serials = {gyro.serial: gyro.name for gyro in row.bench_file.gyros}
        self._points = {
            serials[serial]: RunningPoints(store, number)
            for serial, number in row.recordings.items()
            if serial in serials
        }
        self._asked = -1  # the first time something is known at once

    def evaluate(self, *, is_last: bool = False) -> list[UnitU]:
        """Return U of each unit; nothing where it is too soon. `is_last`: by all data sets, and of the fit."""
        self._asked += 1
        if not is_last and self._asked % self._every:
            return []
        dropped = self._dropped()
        return [
            unit_u(gyro, points.read(), self._recipe, self._rules, is_last=is_last)
            for gyro, points in self._points.items()
            if gyro not in dropped
        ]

    def _dropped(self) -> Mapping[str, str]:
        return self._store.campaigns.summaries([self._campaign])[self._campaign].dropped


def unit_u(gyro: str, recording: Recording, recipe: Recipe, rules: StopRules, *, is_last: bool = False) -> UnitU:
    """Return U of one unit by the means of a campaign so far; `is_last`: U of the fit also where it is above the limit.

    The lower bound comes first, because it takes a tenth of the time and is most often above the limit.
    """
    sets = int(np.sum(~is_marked(recording)))
    try:
        data, preset = data_and_preset(recording, rules.model, rules.effects)
    except LabctlError as error:
        return UnitU(gyro, sets, "unknown", None, why=str(error))
    over, missing = _range_of(data, recipe, rules)
    if not is_last or missing:
        least = least_u(data, preset, over)
        if missing or least.u_dps is None or least.u_dps > rules.u_dps:
            return _answer(gyro, sets, "at least", least, why=missing)
    largest = largest_u(data, preset, over)
    if largest.u_dps is not None and largest.u_dps <= rules.u_dps:
        return _answer(gyro, sets, "of the fit", largest, why=lack_of_fit(data, preset, over, rules.u_dps))
    return _answer(gyro, sets, "of the fit", largest, largest.more_sets(rules.u_dps))


def _answer(gyro: str, sets: int, known: Known, largest: LargestU, more: int | None = None, why: str = "") -> UnitU:
    if largest.u_dps is None:
        return UnitU(
            gyro, sets, "unknown", None, largest.axis, largest.rate_dps, largest.temperature_c, largest.why or why
        )
    parts = largest.parts_dps or {}
    total = sum(part**2 for part in parts.values())
    share = parts.get("model", 0.0) ** 2 / total if total else 0.0
    return UnitU(
        gyro,
        sets,
        known,
        largest.u_dps,
        largest.axis,
        largest.rate_dps,
        largest.temperature_c,
        why,
        more,
        model_share=share,
    )


def _range_of(data: FitData, recipe: Recipe, rules: StopRules) -> tuple[Range, str]:
    """Return the range over which U is wanted, in temperatures of the unit, and what of it is not measured yet.

    The ends of the recipe are set points of the chamber; a unit at them is as warm as its data sets there were, and at
    an end that is still to come by as much warmer than the set point as it was so far.
    """
    rates = rules.rates_dps or (min(recipe.rates_dps), max(recipe.rates_dps))
    cold_c, warm_c = rules.temperature_c or (min(recipe.temperatures_c), max(recipe.temperatures_c))
    unit_c = np.asarray(data.temperature_c, dtype=np.float64)
    if "chamber_setpoint_c" not in data.channels:
        return Range(rates, (cold_c, warm_c), rules.repeatability), "the set point of the chamber is not recorded"
    set_c = np.asarray(data.channels["chamber_setpoint_c"], dtype=np.float64)
    warmer_c = float(np.median(unit_c - set_c))
    inside = (set_c >= cold_c - NEAR_C) & (set_c <= warm_c + NEAR_C)
    ends_c = [float(unit_c[inside].min()), float(unit_c[inside].max())] if inside.any() else [math.inf, -math.inf]
    if not np.any(set_c <= cold_c + NEAR_C):
        ends_c[0] = min(ends_c[0], cold_c + warmer_c)
    if not np.any(set_c >= warm_c - NEAR_C):
        ends_c[1] = max(ends_c[1], warm_c + warmer_c)
    over = Range(rates, (ends_c[0], max(ends_c)), rules.repeatability)
    return over, _missing(data, recipe, set_c, (cold_c, warm_c), rates)


def _missing(
    data: FitData, recipe: Recipe, set_c: Array, temperature_c: tuple[float, float], rates_dps: tuple[float, float]
) -> str:
    """Return which end of the range was not measured in some position, in words; empty where all were."""
    position, rate = np.asarray(data.channels["position"]), data.channels.table_rate_dps()
    near_dps = NEAR_SHARE * max(map(abs, rates_dps))
    for one in dict.fromkeys(recipe.positions):
        is_it = position == one
        if not is_it.any():
            return f"nothing was measured with {one} up yet"
        if not np.any(is_it & (set_c <= temperature_c[0] + NEAR_C)):
            return f"{temperature_c[0]:g} deg C was not measured with {one} up yet"
        if not np.any(is_it & (set_c >= temperature_c[1] - NEAR_C)):
            return f"{temperature_c[1]:g} deg C was not measured with {one} up yet"
        if not np.any(is_it & (rate <= rates_dps[0] + near_dps)):
            return f"{rates_dps[0]:g} deg/s was not measured with {one} up yet"
        if not np.any(is_it & (rate >= rates_dps[1] - near_dps)):
            return f"{rates_dps[1]:g} deg/s was not measured with {one} up yet"
    return ""
