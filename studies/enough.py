"""Campaigns that end when U is small enough: coverage of U on a later day, and the hours that are saved.

Simulated units with laws of their own (`use_coverage`) are measured by a plan of two passes through all temperatures,
each up and down. After every fourth data set U of the fit is compared with the target, as a campaign does, and the
first time that it is reached ends the campaign. On a later day, after another power-on and with another drift, the
corrected rate is compared with the truth. Beside it: the same units by the whole plan, and by about as many data sets
as end most campaigns. Looking often at U and ending at a small one selects campaigns whose residuals are small by
chance; the difference to the last shows how much that costs.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.uncertainty import use_evidence
from labctl.fitting.uncertainty.budget import budget_of
from labctl.fitting.uncertainty.over_range import data_and_preset
from labctl.fitting.uncertainty.rate_vector import rate_vector_uncertainty
from labctl.recording import Recording
from labctl.services.sufficiency.evaluation import unit_u
from procedures.recipe.recipe import Recipe
from studies.use_coverage import DRIFT_DPS, MODELS, PLACES, RATES, TURN_ON_DPS, WARM_C, Unit, campaign, corrected

UNITS = int(os.environ.get("LABCTL_STUDY_ENOUGH_UNITS", "100"))
WORKERS = int(os.environ.get("LABCTL_STUDY_ENOUGH_WORKERS", "2"))
FIRST_SEED = 20_001
EVERY, SET_S, SOAK_S = 4, 75.0, 5400.0
PASS_C = (*WARM_C[::2], *WARM_C[1::2][::-1])
#: Targets, deg/s, and whether U counts a later power-on, whose difference alone gives 0.0057; drift alone gives 0.002.
TARGETS = {
    "adequate": ((0.0065, True), (0.004, False), (0.003, False)),
    "bias a parabola": ((0.004, False),),
}


@dataclass(frozen=True)
class End:
    """How one campaign ended."""

    reached: bool | None  #: None: it ends there whatever U is
    sets: int
    hours: float
    inside: tuple[bool, ...]  #: whether the error is within U, at each place
    within_target: tuple[bool, ...]  #: whether the error is within the target


def plan_of(unit: Unit, turn_on_dps: float, rng: np.random.Generator) -> tuple[Recording, NDArray[np.float64]]:
    """Return the means of a whole plan in one powered run, and the hours after each data set."""
    passes = tuple(float(warm) for warm in (*PASS_C, *PASS_C))
    recording = campaign(unit, 1, rng, levels_c=passes, turn_on_dps=turn_on_dps)
    set_c = np.repeat(passes, len(RATES))
    hours = (np.arange(1, len(set_c) + 1) * SET_S + SOAK_S * (1 + np.arange(len(set_c)) // len(RATES))) / 3600
    return replace(recording, columns={**recording.columns, "chamber_setpoint_c": set_c}), hours


def recipe_of(effects: tuple[str, ...], target_dps: float, *, later: bool) -> Recipe:
    """Return the recipe of the plan."""
    return Recipe.model_validate(
        {
            "name": "enough",
            "temperatures_c": WARM_C.tolist(),
            "rates_dps": RATES.tolist(),
            "positions": ["z"],
            "stop": {"u_dps": target_dps, "effects": list(effects), "repeatability": later},
        }
    )


def sets_of(recording: Recording, sets: int) -> Recording:
    """Return the first data sets."""
    return replace(recording, columns={name: values[:sets] for name, values in recording.columns.items()})


def ends_at(recording: Recording, recipe: Recipe) -> int | None:
    """Return the number of data sets after which a campaign ends; None: with its plan."""
    assert recipe.stop is not None
    for sets in range(EVERY, len(recording) + 1, EVERY):
        if unit_u("unit", sets_of(recording, sets), recipe, recipe.stop).reaches(recipe.stop.u_dps):
            return sets
    return None


Judged = tuple[tuple[bool, ...], tuple[bool, ...]]


def judged(
    unit: Unit, recording: Recording, effects: tuple[str, ...], later_dps: float, target_dps: float, *, later: bool
) -> Judged:
    """Return whether the errors on a later day are within U of a fit, and within the target, at each place.

    Not `later`: within the same power-on, and U without repeatability.
    """
    data, preset = data_and_preset(recording, None, effects)
    fitted, evidence = fit_preset(data, preset).fitted, use_evidence(data, preset)
    errors, claims = [], []
    for rate, warm in PLACES.values():
        output = np.array([rate]) + unit.error_dps(np.array([rate]), np.array([warm])) + later_dps
        errors.append(abs(corrected(fitted, output, warm) - rate))
        lines = rate_vector_uncertainty(fitted, {"z": rate}, warm, evidence=evidence, name="unit").budgets["z"].lines
        counted = [line for line in lines if later or line.source != "repeatability"]
        claim = budget_of("corrected_rate", "deg/s", counted).expanded
        claims.append(np.inf if claim is None else claim)
    inside = tuple(bool(error <= claim) for error, claim in zip(errors, claims, strict=True))
    return inside, tuple(bool(error <= target_dps) for error in errors)


#: Model, where the campaign ends in words, and whether a later power-on counts.
Key = tuple[str, str, bool]
WHOLE, FIRST = "the whole plan", 52


def ends_of(seed: int) -> dict[Key, End]:
    """Return how a unit's campaigns ended."""
    rng = np.random.default_rng(seed)
    unit, turn_on_dps = Unit.drawn(rng), TURN_ON_DPS * rng.normal()
    recording, hours = plan_of(unit, turn_on_dps, rng)
    drift_dps = rng.normal(0, DRIFT_DPS)
    off_dps = {True: drift_dps + TURN_ON_DPS * rng.normal(), False: drift_dps + turn_on_dps}
    found: dict[Key, End] = {}
    for case, targets in TARGETS.items():
        effects, whole = MODELS[case], len(recording)
        for target, later in targets:
            reached = ends_at(recording, recipe_of(effects, target, later=later))
            sets = reached or whole
            verdict = judged(unit, sets_of(recording, sets), effects, off_dps[later], target, later=later)
            found[case, f"U {target:g} deg/s", later] = End(reached is not None, sets, float(hours[sets - 1]), *verdict)
        for later in (True, False):
            for name, sets in ((WHOLE, whole), (f"the first {FIRST}", FIRST)):
                verdict = judged(unit, sets_of(recording, sets), effects, off_dps[later], np.inf, later=later)
                found[case, name, later] = End(None, sets, float(hours[sets - 1]), *verdict)
    return found


def _share(values: list[tuple[bool, ...]]) -> str:
    """Return a share in percent with its interval over the units: one unit has one power-on for all places."""
    each = np.mean(values, axis=1)
    half = 196 * float(each.std(ddof=1)) / np.sqrt(len(each)) if len(each) > 1 else np.nan
    middle = 100 * float(each.mean())
    return f"{middle:.1f} ({middle - half:.1f} to {min(middle + half, 100.0):.1f})"


def _row(key: Key, ends: list[End], whole_h: float) -> str:
    case, name, later = key
    is_fixed, reached = ends[0].reached is None, [end for end in ends if end.reached]
    hours = np.array([end.hours for end in ends])
    cells = [case, "another" if later else "the same", name]
    cells += ["–"] if is_fixed else [f"{len(reached)} of {len(ends)}"]
    cells += [f"{np.median([end.sets for end in ends]):.0f}", f"{np.median(hours):.1f}"]
    cells += [f"{100 * (1 - hours.mean() / whole_h):.0f} %"]
    chosen = ends if is_fixed else reached
    cells += [_share([end.inside for end in chosen])] if len(chosen) > 1 else ["–"]
    cells += [_share([end.within_target for end in reached])] if len(reached) > 1 else ["–"]
    return "| " + " | ".join(cells) + " |"


def table_of(found: Sequence[Mapping[Key, End]]) -> str:
    """Return the table of all units."""
    columns = (
        "model", "power-on", "ends at", "reached", "data sets, median", "hours, median", "saved, mean",
        "reached: within U, %", "within the target, %",
    )  # fmt: skip
    lines = [f"| {' | '.join(columns)} |", "| --- " * len(columns) + "|"]
    whole_h = next(end.hours for (_, name, _), end in found[0].items() if name == WHOLE)
    keys = sorted(found[0], key=lambda key: (key[0], not key[2], key[1][0] == "U", key[1] != WHOLE))
    return "\n".join([*lines, *(_row(key, [each[key] for each in found], whole_h) for key in keys)])


def run(units: int = UNITS) -> str:
    """Return coverage and hours, by model and target."""
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        found = list(pool.map(ends_of, range(FIRST_SEED, FIRST_SEED + units)))
    return f"{units} units\n{table_of(found)}"
