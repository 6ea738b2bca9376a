"""What turning a unit on its face is worth: U of a misalignment before and after, and how well both cover.

Units, benches and campaigns are simulated with numpy alone (`rate_vector_simulation`); fixture, tilt and the
repeatability of mounting are drawn from what they are stated as. `LABCTL_STUDY_UNITS` is how many units of each
schedule, `LABCTL_STUDY_WORKERS` how many processes, `LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.uncertainty import coefficient_budgets, conditions_of, use_evidence
from labctl.recording import Recording
from studies.rate_vector_coverage import MODEL, Case, info_of
from studies.rate_vector_simulation import AXES, PLANS, Array, Bench, Noise, Plan, Statement, Unit, campaign

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "40"))
WORKERS = int(os.environ.get("LABCTL_STUDY_WORKERS", "2"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "80001"))
ADDED = {
    "nothing": "",
    "each unit turned by 180 deg on its face": "@180",
    "the fixture turned by 180 deg on the table": "@0/180",
    "the fixture turned by 90 deg on the table": "@0/90",
}
SCHEDULES = tuple(plan for plan in PLANS if not plan.turned)
CASES = tuple((plan, what) for plan in SCHEDULES for what in ADDED)
MIDDLE_C = 20.0


@dataclass(frozen=True)
class Found:
    """The six misalignments of one unit."""

    error: Array  #: (6,) found minus true, rad
    expanded: Array  #: (6,) rad


def with_turned(plan: Plan, suffix: str) -> Plan:
    """Return a plan with each of its mountings once more, turned as the suffix of its position says."""
    return replace(plan, turned=tuple(f"{position}{suffix}" for position in plan.positions) if suffix else ())


@single_threaded
def found(number: int) -> Found:
    """Return the misalignments that a campaign finds."""
    plan, what = CASES[number % len(CASES)]
    plan = with_turned(plan, ADDED[what])
    rng, stated, noise = np.random.default_rng([FIRST_SEED, number]), Statement(), Noise()
    unit, bench = Unit.of(rng, 0.0), Bench.of(rng, stated, plan.mountings)
    columns = campaign(unit, bench, plan, noise, stated.turn_on_dps, rng)
    recording = with_temperature(Recording(info_of(Case(plan, AXES, True), stated), columns))
    data, preset = fit_data_of(recording), preset_for(None, list(MODEL))
    result, evidence = fit_preset(data, preset), use_evidence(data, preset)
    conditions = conditions_of(recording.info, result.environment, mountings=result.mountings)
    budgets = coefficient_budgets(result.fitted, MIDDLE_C, evidence=evidence, name="unit", bench=conditions)
    error, expanded = [], []
    for row, axis in enumerate(AXES):
        for column, other in enumerate(AXES):
            if other != axis:
                budget = budgets[axis][f"misalignment_{other}"]
                error.append((budget.value or 0.0) - unit.gain[row, column])
                expanded.append(budget.expanded or np.nan)
    return Found(np.array(error), np.array(expanded))


def _row(plan: Plan, what: str, every: Sequence[Found]) -> str:
    over = np.array([one.error / one.expanded for one in every])
    inside = np.mean(np.abs(over) <= 1, axis=1)
    half = 1.96 * float(np.std(inside, ddof=1)) / np.sqrt(len(inside)) if len(inside) > 1 else 0.5
    rms, u = (float(np.sqrt(np.mean([getattr(one, name) ** 2 for one in every]))) for name in ("error", "expanded"))
    share = (
        f"{100 * inside.mean():.1f} ({100 * (inside.mean() - half):.1f} to {100 * min(inside.mean() + half, 1):.1f})"
    )
    return f"| {plan.name} | {what} | {len(every)} | {u:.2g} | {2 * rms:.2g} | {share} |"


def run(units: int = UNITS) -> str:
    """Return U of the misalignments, twice their root mean square error, and the share inside U, by schedule."""
    total = units * len(CASES)
    if WORKERS > 1:
        with ProcessPoolExecutor(max_workers=WORKERS) as pool:
            every = list(pool.map(found, range(total), chunksize=4))
    else:
        every = [found(number) for number in range(total)]
    lines = [
        "| schedule | added | units | U, rad | 2 RMS error, rad | inside U, % |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    lines += [_row(plan, what, every[k :: len(CASES)]) for k, (plan, what) in enumerate(CASES)]
    return "\n".join(lines)
