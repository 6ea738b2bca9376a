"""The next experiment: which changed recipe would tell two suspects apart, for its hours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import tomli_w
from scipy.special import ndtr

from instruments.bench_config import BenchFile
from labctl.errors import LabctlError
from labctl.fitting.criticism import Criticism
from labctl.fitting.criticism.evidence import reproduced_of, solve_option
from labctl.fitting.criticism.verdict import LEAD
from labctl.fitting.effects import Term
from labctl.services.planning.loading import bench_for, limits_of, load_bench, recipe_document
from labctl.services.simulation.walk import Schedule, walk
from labctl.store import Store
from procedures.contracts.errors import ProcedureError
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import Recipe

#: At most this many rivals are held against the leader, and this many experiments shown.
PAIRS, SHOWN = 6, 4
#: More separation (chi2) than this makes an answer no surer.
SURE = 40.0


def experiments_for(store: Store, recording: int, found: Criticism) -> list[dict[str, Any]]:
    """Return changed recipes that would separate what a verdict could not.

    First come those that tell the leader from most rivals, among them those that do so best per hour.
    """
    if found.weighed is None or not found.verdict.untold:
        return []
    base = _recipe_of(store, recording, found)
    if base is None:
        return []
    recipe, bench = base
    signal = _signal(found)
    rivals = [name for name in found.verdict.untold[1 : 1 + PAIRS] if name in signal.others]
    ranked: list[dict[str, Any]] = []
    for text, changes in menu(recipe):
        try:
            changed = Recipe.model_validate({**recipe.model_dump(), **changes})
            plan = make_plan(changed, limits_of(bench), clip=True)
            schedule = walk(plan, bench, found.weighed.model)
        except (LabctlError, ProcedureError, ValueError):
            continue
        deltas = {rival: separation(schedule, signal.leader, signal.coefficients, rival) for rival in rivals}
        told = [rival for rival, delta in deltas.items() if delta > LEAD]
        if not told:
            continue
        delta = min(deltas[rival] for rival in told)
        hours = plan.expected_s / 3600
        document = recipe_document(changed) | {"name": f"{recipe.name}-next"}
        ranked.append(
            {
                "separates": [signal.leader.effect, *told],
                "do": text,
                "recipe": document,
                "toml": tomli_w.dumps(document),
                "power": float(ndtr((delta / 2 - LEAD) / np.sqrt(delta))),
                "hours": hours,
                "per_hour": min(delta, SURE) / hours,
            }
        )
    return sorted(ranked, key=lambda e: (-len(e["separates"]), -e["per_hour"]))[:SHOWN]


def menu(recipe: Recipe) -> list[tuple[str, dict[str, Any]]]:
    """Return the changes that may tell effects apart, each with what a person would say."""
    temperatures = sorted(recipe.temperatures_c)
    middle = temperatures[len(temperatures) // 2]
    few = sorted({0.0, *(s * abs(r) for r in _spread(recipe.rates_dps) for s in (1, -1))})
    short: dict[str, Any] = {"temperatures_c": [middle], "rates_dps": few}
    inside = {"mounting": {**recipe.mounting.model_dump(), "repower_each": False}}
    up_and_down = {"inverted": {"temperatures_c": [middle], "rates_dps": [0.0, *few[:2], *few[-2:]]}, **inside}
    return [
        ("each position also upside down, in one powered run, at one temperature", {**short, **up_and_down}),
        ("each position also upside down, in one powered run", up_and_down),
        ("a power cycle at constant temperature", {**short, "power_cycle": {"off_s": 600.0, "rates_dps": few}}),
        ("the temperatures up and down", {"temperature_order": "up_down"}),
        ("the rates in random order", {"rate_order": "random"}),
        ("random rates, temperatures up and down", {"rate_order": "random", "temperature_order": "up_down"}),
        ("the first temperature again at the end", {"replicates": {"first_temperature_again": True}}),
        ("more rates in the top third", {"rates_dps": _top(recipe.rates_dps), "temperatures_c": [middle]}),
    ]


def _spread(rates: tuple[float, ...]) -> list[float]:
    sizes = sorted({abs(rate) for rate in rates if rate})
    return [sizes[len(sizes) // 2], sizes[-1]] if sizes else []


def _top(rates: tuple[float, ...]) -> list[float]:
    most = max(abs(rate) for rate in rates)
    sizes = [round(float(share) * most, 3) for share in (0.3, 0.5, *np.arange(0.66, 1.001, 0.04))]
    return [0.0, *(sign * size for size in sizes for sign in (1, -1))]


class _Signal:
    """What the leading suspect was found to do."""

    def __init__(self, leader: Term, coefficients: Mapping[str, np.ndarray], others: set[str]) -> None:
        self.leader, self.coefficients, self.others = leader, coefficients, others


def _signal(found: Criticism) -> _Signal:
    weighed = found.weighed
    assert weighed is not None
    leader = next(c for c in weighed.candidates if c.id == found.verdict.untold[0] and not c.smooth)
    assert leader.term is not None
    values = {}
    for axis, index in leader.option.items():
        values[axis] = solve_option(weighed.axes[axis].best, weighed.axes[axis].slices[index])[0]
    return _Signal(leader.term, values, {c.id for c in weighed.candidates if not c.smooth})


def separation(schedule: Schedule, leader: Term, coefficients: Mapping[str, np.ndarray], rival: str) -> float:
    """Return the chi2 by which a rival would fail to explain the leader's signal on another schedule."""
    total = 0.0
    for axis, values in coefficients.items():
        if axis not in schedule.designs:
            continue
        options = schedule.options(axis)
        own = [
            (_apart(option.term, leader), where)
            for option, where in options
            if option.candidate == leader.effect and where.stop - where.start == len(values)
        ]
        if not own:
            continue
        _, signal = min(own, key=lambda pair: pair[0])
        left = schedule.left[axis]
        size = float(values @ left.gram[signal, signal] @ values)
        shared = max(
            (reproduced_of(left, signal, values, where) for o, where in options if o.candidate == rival), default=0.0
        )
        total += max(size - shared, 0.0)
    return total


def _apart(term: Term | None, leader: Term) -> float:
    """Return how far a shape of the grid is from the refined one that was found."""
    if term is None or term.order != leader.order or set(term.parameters) != set(leader.parameters):
        return np.inf
    return sum(
        abs(float(np.log((term.parameters[name] + 1e-9) / (leader.parameters[name] + 1e-9))))
        for name in leader.parameters
    )


def _recipe_of(store: Store, recording: int, found: Criticism) -> tuple[Recipe, BenchFile] | None:
    """Return the recipe that a recording was made by, or one like it, and a bench to walk through changed ones."""
    campaign = store.recordings.get(recording).campaign
    try:
        if campaign is not None:
            row = store.campaigns.get(campaign)
            return Recipe.model_validate(dict(row.recipe)), BenchFile.model_validate(dict(row.bench))
        recipe = _like(found)
        return recipe, load_bench(bench_for(recipe))
    except (LabctlError, ProcedureError, ValueError):
        return None


def _like(found: Criticism) -> Recipe:
    data = found.data
    warm = data.nodes["chamber_setpoint_c"] if "chamber_setpoint_c" in data.nodes else data.nodes.temperature_c("")
    levels = np.unique(np.round(data.at_sets(np.asarray(warm, dtype=np.float64))))
    rates = np.unique(np.round(data.at_sets(data.nodes.table_rate_dps()), 1))
    history = data.nodes.history
    each = 1 < len(history.numbers("mounting")) <= len(history.numbers("run"))
    lasted = data.nodes.durations_s().reshape(len(data), -1).sum(axis=1)
    return Recipe.model_validate(
        {
            "name": data.info.serial,
            "temperatures_c": levels[:: max(len(levels) // 12, 1)].tolist(),
            "rates_dps": rates[:: max(len(rates) // 25, 1)].tolist(),
            "positions": sorted(there for there, _ in data.nodes.positions()),
            "mounting": {"repower_each": each},
            "acquire": {"duration_s": float(np.clip(np.median(lasted), 1.0, 120.0))},
        }
    )
