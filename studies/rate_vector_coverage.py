"""Coverage of the uncertainty of a rate vector: a robot turns about any axis, at any temperature, on a later day.

Every campaign is another unit on another bench, simulated with numpy alone (`rate_vector_simulation`), for three plans
of mountings, tri-axial units and units with one output, with a model that is adequate and with one that lacks what the
unit does. Rate vectors are uniform in the ball up to the fastest rate. `LABCTL_STUDY_UNITS` is how many units,
`LABCTL_STUDY_WORKERS` how many processes, `LABCTL_STUDY_SEED` the first seed.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.uncertainty import conditions_of, rate_vector_uncertainty, use_evidence
from labctl.recording import Recording, RecordingInfo, Standard
from studies.rate_vector_simulation import AXES, PLANS, Array, Bench, Noise, Plan, Statement, Unit, campaign, in_ball

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "400"))
WORKERS = int(os.environ.get("LABCTL_STUDY_WORKERS", "2"))
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_SEED", "70001"))
#: Rate vectors of each unit; cells of the table: shells of the ball by equal shares, and temperatures.
VECTORS, SHELLS, WARM = 75, 5, 5
#: The hidden effect of units whose model is inadequate, deg/s at the fastest rate.
HIDDEN_DPS = 0.02
MODEL = ("bias", "bias_temperature:2", "scale_factor", "scale_factor_temperature:1", "misalignment")


@dataclass(frozen=True)
class Case:
    """What one unit is: its plan, its outputs, and whether the model lacks an effect."""

    plan: Plan
    outputs: tuple[str, ...]
    is_adequate: bool

    def __str__(self) -> str:
        outputs = "tri-axial" if len(self.outputs) > 1 else "output z alone"
        return f"{self.plan.name}, {outputs}, model {'adequate' if self.is_adequate else 'inadequate'}"


CASES = tuple(Case(plan, outputs, good) for good in (True, False) for plan in PLANS for outputs in (AXES, ("z",)))


@dataclass(frozen=True)
class Scores:
    """One unit: errors over U, (vectors, outputs), NaN where U is unknown; and in which cell each vector was."""

    case: int
    over_u: Array
    over_aligned_u: Array  #: after the rotation that aligns best was taken off, over U up to a rotation
    shell: Array
    warm: Array


@single_threaded
def scores(number: int) -> Scores:
    """Return how far the corrected rates of one unit are off."""
    case = CASES[number % len(CASES)]
    rng, stated, noise, plan = np.random.default_rng([FIRST_SEED, number]), Statement(), Noise(), case.plan
    unit = Unit.of(rng, 0.0 if case.is_adequate else HIDDEN_DPS)
    bench = Bench.of(rng, stated, plan.mountings)
    columns = campaign(unit, bench, plan, noise, stated.turn_on_dps, rng)
    recording = with_temperature(Recording(info_of(case, stated), columns))
    data, preset = fit_data_of(recording), preset_for(None, list(MODEL))
    result, evidence = fit_preset(data, preset), use_evidence(data, preset)
    conditions = conditions_of(recording.info, result.environment, mountings=result.mountings)
    rates = in_ball(rng, VECTORS, plan.reach_dps)
    warm = rng.uniform(min(plan.temperatures_c), max(plan.temperatures_c), VECTORS)
    later = rng.normal(0, stated.turn_on_dps, 3) + rng.normal(0, noise.drift_dps, (VECTORS, 3))
    output = unit.output(rates, warm, plan.reach_dps) + later
    rows = [AXES.index(axis) for axis in case.outputs]
    error = corrected(result.fitted, output[:, rows], warm, case.outputs) - rates[:, rows]
    claimed = [
        rate_vector_uncertainty(
            result.fitted, dict(zip(AXES, rate, strict=True)), at, evidence=evidence, name="unit", bench=conditions
        )
        for rate, at in zip(rates.tolist(), warm.tolist(), strict=True)
    ]
    u = np.array([[each.budgets[axis].expanded or np.nan for axis in case.outputs] for each in claimed])
    aligned = np.array([[each.aligned_budgets[axis].expanded or np.nan for axis in case.outputs] for each in claimed])
    turned = _aligned(error, rates) if len(rows) == len(AXES) else error
    size = np.linalg.norm(rates, axis=1) / plan.reach_dps
    shell = np.minimum((SHELLS * size**3).astype(int), SHELLS - 1)
    low, high = min(plan.temperatures_c), max(plan.temperatures_c)
    level = np.minimum((WARM * (warm - low) / (high - low)).astype(int), WARM - 1)
    return Scores(number % len(CASES), error / u, turned / aligned, shell, level)


def info_of(case: Case, stated: Statement) -> RecordingInfo:
    """Return the head of a recording, with the standards that the bench states."""
    standards = (
        Standard(quantity="clock", u=stated.clock_ppm),
        Standard(quantity="thermometer", u=stated.thermometer_c),
        Standard(quantity="chamber_gradient", half_width=stated.gradient_half_width_c, distribution="rectangular"),
        Standard(quantity="fixture_angle", u=stated.fixture_deg),
        Standard(quantity="mounting_repeatability", u=stated.mounting_deg),
        Standard(quantity="tilt", half_width=stated.tilt_half_width_deg, distribution="rectangular"),
    )
    return RecordingInfo(
        serial="VECTOR", axes=case.outputs, kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC),
        max_rate_dps=case.plan.reach_dps, standards=standards, datasheet={"bias_stability_dps": stated.turn_on_dps},
    )  # fmt: skip


def corrected(fitted: FittedModel, output: Array, warm: Array, outputs: tuple[str, ...]) -> Array:
    """Return corrected rates, (n, outputs) deg/s, of outputs (n, outputs) at temperatures (n,)."""
    columns = {"temperature_c": warm, "table_rate_dps": np.zeros(len(warm)), "position": np.full(len(warm), "z")}
    measured = {axis: output[:, number] for number, axis in enumerate(outputs)}
    found = fitted.compensate(measured, Channels(columns, measured))
    return np.column_stack([found[axis] for axis in outputs])


def _aligned(error: Array, rates: Array) -> Array:
    """Return errors (n, 3) without the rotation of the frame that explains most of them (least squares)."""
    x, y, z = rates.T
    zero = np.zeros_like(x)
    turning = np.stack(  # d (f x w) / d f, (n, 3, 3)
        [np.stack([zero, z, -y], 1), np.stack([-z, zero, x], 1), np.stack([y, -x, zero], 1)], axis=1
    )
    angles, *_ = np.linalg.lstsq(turning.reshape(-1, 3), error.ravel(), rcond=None)
    return np.asarray(error - turning @ angles)


def _share(found: list[Array]) -> str:
    """Return the share inside U, with its 95 % interval by the scatter of units; each unit's errors over U in one."""
    inside = np.array([np.mean(np.abs(one[np.isfinite(one)]) <= 1) for one in found if np.isfinite(one).any()])
    if len(inside) == 0:
        return "-"
    half = 1.96 * float(np.std(inside, ddof=1)) / np.sqrt(len(inside)) if len(inside) > 1 else 0.5
    middle = float(np.mean(inside))
    return f"{100 * middle:.1f} ({100 * (middle - half):.1f} to {min(100 * (middle + half), 100):.1f})"


def _unknown(found: list[Array]) -> str:
    every = np.concatenate([one.ravel() for one in found])
    return f"{100 * float(np.mean(~np.isfinite(every))):.1f}"


def _table(every: list[Scores]) -> list[str]:
    by_case: Mapping[int, list[Scores]] = defaultdict(list)
    for each in every:
        by_case[each.case].append(each)
    lines = [
        "| units | n | components inside U, % | up to a rotation, % | U unknown, % |",
        "| --- | --- | --- | --- | --- |",
    ]
    for number, case in enumerate(CASES):
        found = [each.over_u for each in by_case[number]]
        aligned = [each.over_aligned_u for each in by_case[number]] if len(case.outputs) > 1 else []
        lines.append(f"| {case} | {len(found)} | {_share(found)} | {_share(aligned)} | {_unknown(found)} |")
    return lines


def _cells(every: list[Scores], title: str) -> list[str]:
    warm = " | ".join(f"{100 * k // WARM} to {100 * (k + 1) // WARM} %" for k in range(WARM))
    lines = [f"| {title}: rate, share of the fastest | temperature, {warm} |", "| --- " * (WARM + 1) + "|"]
    for shell in range(SHELLS):
        low, high = ((shell + k) / SHELLS for k in (0, 1))
        cells = [
            _share([each.over_u[(each.shell == shell) & (each.warm == level)] for each in every])
            for level in range(WARM)
        ]
        lines.append(f"| {low ** (1 / 3):.2f} to {high ** (1 / 3):.2f} | " + " | ".join(cells) + " |")
    return lines


def run(units: int = UNITS) -> str:
    """Return the shares of corrected rates inside U, by case and by cell of rate and temperature."""
    if WORKERS > 1:
        with ProcessPoolExecutor(max_workers=WORKERS) as pool:
            every = list(pool.map(scores, range(units), chunksize=4))
    else:
        every = [scores(number) for number in range(units)]
    lines = _table(every)
    for good in (True, False):
        for alone in (False, True):
            some = [
                x for x in every if CASES[x.case].is_adequate is good and (len(CASES[x.case].outputs) == 1) is alone
            ]
            title = f"model {'adequate' if good else 'inadequate'}, {'output z alone' if alone else 'tri-axial'}"
            lines += ["", *_cells(some, title)]
    return "\n".join(lines)
