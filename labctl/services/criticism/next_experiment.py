"""The next experiment: which changed recipe would separate the effects that a criticism could not, per hour."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import tomli_w

from instruments.bench_config import BenchFile
from labctl.answers.criticism import Experiment
from labctl.errors import LabctlError
from labctl.fitting.criticism import (
    SEPARATED_CHI2,
    Criticism,
    LeadingSignal,
    leading_signal,
    separation_chi2,
    separation_power,
)
from labctl.fitting.models.error_model import ErrorModel
from labctl.services.planning.loading import bench_for, limits_of, load_bench
from labctl.services.simulation.visibility import planned_schedule
from labctl.store import Store
from procedures.contracts.errors import ProcedureError
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe, recipe_document

#: At most this many rivals are separated from the leader, and this many experiments are shown.
PAIRS, SHOWN = 6, 4
#: More separation (chi2) than this does not count: the answer is as good as certain.
MAX_CHI2 = 40.0


def experiments_for(store: Store, campaign: int | None, criticism: Criticism) -> list[Experiment]:
    """Return changed recipes that would separate what a verdict could not distinguish, best first.

    `campaign` is the recording's, if it has one. First come the recipes that separate the leader from most rivals,
    among them those with the largest separation per hour.
    """
    if criticism.comparison is None or not criticism.verdict.indistinguishable:
        return []
    base = _recipe_of(store, campaign, criticism)
    if base is None:
        return []
    recipe, bench = base
    effects = {c.id for c in criticism.comparison.candidates if not c.smooth}
    leader, *others = criticism.verdict.indistinguishable
    signal = leading_signal(criticism.comparison, leader)
    rivals = [name for name in others[:PAIRS] if name in effects]
    floor_dps = {axis: float(np.median(residuals.floor_dps)) for axis, residuals in criticism.residuals.items()}
    tried = (
        _experiment(text, changes, recipe, bench, signal, rivals, criticism.comparison.model, floor_dps)
        for text, changes in menu(recipe)
    )
    ranked = [experiment for experiment in tried if experiment is not None]
    return sorted(ranked, key=lambda e: (-len(e["separates"]), -e["per_hour"]))[:SHOWN]


def _experiment(
    text: str, changes: Mapping[str, object], recipe: Recipe, bench: BenchFile, signal: LeadingSignal,
    rivals: list[str], model: ErrorModel, floor_dps: Mapping[str, float],
) -> Experiment | None:  # fmt: skip
    """Return a changed recipe with what it separates; None where it cannot be run on the bench or separates nothing."""
    try:
        changed = Recipe.model_validate({**recipe.model_dump(), **changes})
        plan = make_plan(changed, limits_of(bench), clip=True)
        schedule = planned_schedule(plan, bench, model)
    except (LabctlError, ProcedureError, ValueError):
        return None
    chi2 = {rival: separation_chi2(schedule, signal, rival, floor_dps) for rival in rivals}
    separated = [rival for rival, value in chi2.items() if value > SEPARATED_CHI2]
    if not separated:
        return None
    least = min(chi2[rival] for rival in separated)
    hours = plan.expected_s / 3600
    document = recipe_document(changed) | {"name": f"{recipe.name}-next"}
    return {
        "separates": [signal.term.effect, *separated],
        "do": text,
        "recipe": document,
        "toml": tomli_w.dumps(document),
        "power": separation_power(least),
        "hours": hours,
        "per_hour": min(least, MAX_CHI2) / hours,
    }


def menu(recipe: Recipe) -> list[tuple[str, dict[str, object]]]:
    """Return the changes of a recipe that may separate effects, each with its description."""
    temperatures = sorted(recipe.temperatures_c)
    middle = temperatures[len(temperatures) // 2]
    few = sorted({0.0, *(s * abs(r) for r in _spread(recipe.rates_dps) for s in (1, -1))})
    short: dict[str, object] = {"temperatures_c": [middle], "rates_dps": few}
    inside: dict[str, object] = {"mounting": {**recipe.mounting.model_dump(), "repower_each": False}}
    up_and_down: dict[str, object] = {
        "inverted": {"temperatures_c": [middle], "rates_dps": [0.0, *few[:2], *few[-2:]]},
        **inside,
    }
    return [
        ("each position also upside down, in one powered run, at one temperature", {**short, **up_and_down}),
        ("each position also upside down, in one powered run", up_and_down),
        ("a power cycle at constant temperature", {**short, "power_cycle": {"off_s": 600.0, "rates_dps": few}}),
        ("the temperatures up and down", {"temperature_order": "up_down"}),
        ("the rates in random order", {"rate_order": "random"}),
        ("random rates, temperatures up and down", {"rate_order": "random", "temperature_order": "up_down"}),
        ("the first temperature repeated at the end", {"replicates": {"first_temperature_again": True}}),
        ("more rates in the top third", {"rates_dps": _top(recipe.rates_dps), "temperatures_c": [middle]}),
    ]


def _spread(rates: tuple[float, ...]) -> list[float]:
    sizes = sorted({abs(rate) for rate in rates if rate})
    return [sizes[len(sizes) // 2], sizes[-1]] if sizes else []


def _top(rates: tuple[float, ...]) -> list[float]:
    most = max(abs(rate) for rate in rates)
    sizes = [round(float(share) * most, 3) for share in (0.3, 0.5, *np.arange(0.66, 1.001, 0.04))]
    return [0.0, *(sign * size for size in sizes for sign in (1, -1))]


def _recipe_of(store: Store, campaign: int | None, criticism: Criticism) -> tuple[Recipe, BenchFile] | None:
    """Return the recipe of the recording's campaign, or one like the recording, and its bench; None without either."""
    try:
        if campaign is not None:
            row = store.campaigns.get(campaign)
            return Recipe.model_validate(dict(row.recipe)), BenchFile.model_validate(dict(row.bench))
        recipe = _recipe_like(criticism)
        return recipe, load_bench(bench_for(recipe))
    except (LabctlError, ProcedureError, ValueError):
        return None


def _recipe_like(criticism: Criticism) -> Recipe:
    """Return a recipe with the temperatures, rates, positions and durations of a recording."""
    data = criticism.data
    temperature_c = (
        data.nodes["chamber_setpoint_c"] if "chamber_setpoint_c" in data.nodes else data.nodes.temperature_c("")
    )
    levels = np.unique(np.round(data.at_sets(np.asarray(temperature_c, dtype=np.float64))))
    rates = np.unique(np.round(data.at_sets(data.nodes.table_rate_dps()), 1))
    history = data.nodes.history
    each = 1 < len(history.numbers("mounting")) <= len(history.numbers("run"))
    lasted = data.nodes.durations_s().reshape(len(data), -1).sum(axis=1)
    return Recipe.model_validate(
        {
            "name": data.info.serial,
            "temperatures_c": levels[:: max(len(levels) // 12, 1)].tolist(),
            "rates_dps": rates[:: max(len(rates) // 25, 1)].tolist(),
            "positions": sorted(position for position, _ in data.nodes.positions()),
            "mounting": {"repower_each": each},
            "acquire": {"duration_s": float(np.clip(np.median(lasted), 1.0, 120.0))},
        }
    )
