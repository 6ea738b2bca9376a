"""Coverage of the budget: the truth against U of coefficients and corrected rates, with true errors of the standards.

Every campaign is another tri-axial unit on another bench. The bench's time base, thermometer, temperature gradient,
mountings and table top are off by errors that are drawn from the distributions that its standards state; the unit has
its own law of rate and temperature, noise, drift and another power-on in use. The campaigns are simulated as means of
data sets in memory (the wires and the readings are left out), so that hundreds of them take minutes.
"""

from __future__ import annotations

import os
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import preset_for
from labctl.fitting.uncertainty import coefficient_budgets, conditions_of, rate_uncertainty, use_evidence
from labctl.recording import Recording, RecordingInfo, Standard

CAMPAIGNS = int(os.environ.get("LABCTL_STUDY_BUDGET_CAMPAIGNS", "200"))
WORKERS = int(os.environ.get("LABCTL_STUDY_BUDGET_WORKERS", "1"))
#: The first seed: none of these campaigns was used while the budget was made.
FIRST_SEED = int(os.environ.get("LABCTL_STUDY_BUDGET_SEED", "50001"))
AXES = ("x", "y", "z")
RATES = np.array([-100, -75, -50, -25, 0, 25, 50, 75, 100], dtype=np.float64)
WARM_C = np.arange(-20.0, 61.0, 16.0)
#: 5 rates by 5 temperatures where the corrected rate is compared.
AT_DPS, AT_C = (-100.0, -50.0, 0.0, 50.0, 100.0), (-20.0, 0.0, 20.0, 40.0, 60.0)
WHITE_DPS, DRIFT_DPS, DRIFT_TAU_S, TURN_ON_DPS = 3e-4, 6e-4, 1800.0, 1e-3
MODEL = ("bias", "bias_temperature:2", "scale_factor", "scale_factor_temperature:1", "misalignment")
STANDARDS = (
    Standard(quantity="clock", expanded=50.0),
    Standard(quantity="thermometer", expanded=0.5),
    Standard(quantity="chamber_gradient", half_width=0.5, distribution="rectangular"),
    Standard(quantity="fixture_angle", expanded=0.05),
    Standard(quantity="tilt", half_width=0.02, distribution="rectangular"),
)
#: Begins the keys of what was compared with the budget of a bench that states no standard.
UNSTATED = "not stated: "
Array = NDArray[np.float64]


def drawn(quantity: str, rng: np.random.Generator, n: int = 1) -> Array:
    """Return n errors from the distribution that the bench's standard of a quantity states, in its unit."""
    standard = next(each for each in STANDARDS if each.quantity == quantity)
    if standard.distribution == "rectangular" and standard.half_width is not None:
        return rng.uniform(-standard.half_width, standard.half_width, n)
    return rng.normal(0.0, standard.standard_u, n)


@dataclass(frozen=True)
class Unit:
    """One unit: K and bias as laws of the temperature."""

    k: Array  #: (3, 3), less 1
    k_warm: Array  #: (3,) per (T - 20) / 40, of the diagonal
    bias: Array  #: (3, 3), of powers of (T - 20) / 40, deg/s

    @staticmethod
    def of(rng: np.random.Generator) -> Unit:
        k = rng.normal(0, 3e-3, (3, 3)) + np.diag(rng.normal(0, 5e-3, 3))
        return Unit(k, rng.normal(0, 2e-3, 3), rng.normal(0, 1, (3, 3)) * np.array([0.1, 0.03, 0.01]))

    def gain(self, warm_c: float) -> Array:
        """Return K less 1, (3, 3), at a temperature."""
        return self.k + np.diag(self.k_warm * (warm_c - 20.0) / 40.0)

    def offset(self, warm_c: float) -> Array:
        """Return the bias, (3,) deg/s, at a temperature."""
        u = (warm_c - 20.0) / 40.0
        return np.asarray(self.bias @ np.array([1.0, u, u * u]))

    def output(self, rate: Array, warm_c: float) -> Array:
        """Return the outputs, (3,) deg/s, at rates (3,) and a temperature."""
        return np.asarray(rate + self.gain(warm_c) @ rate + self.offset(warm_c))


@dataclass(frozen=True)
class Bench:
    """Errors of one bench."""

    clock: float  #: relative error of the indicated rate
    warm_c: float  #: indicated minus true
    tilt_rad: Array  #: (3, 2), of each mounting against the axis of rotation

    @staticmethod
    def of(rng: np.random.Generator) -> Bench:
        warm = float(drawn("thermometer", rng)[0] + drawn("chamber_gradient", rng)[0])
        tilt = np.radians(drawn("fixture_angle", rng, 6).reshape(3, 2) + drawn("tilt", rng, 2))
        return Bench(1e-6 * float(drawn("clock", rng)[0]), warm, tilt)

    def true_rate(self, indicated_dps: float, up: int) -> Array:
        """Return the rate about the body axes, (3,) deg/s, of a mounting with axis number `up` upwards."""
        a, b = self.tilt_rad[up]
        direction = np.zeros(3)
        direction[[up, (up + 1) % 3, (up + 2) % 3]] = np.cos(np.hypot(a, b)), np.sin(a), np.sin(b)
        return indicated_dps / (1 + self.clock) * direction


def drift(t_s: Array, rng: np.random.Generator) -> Array:
    """Return an Ornstein-Uhlenbeck drift of three axes at rising times, (n, 3) deg/s."""
    found = np.empty((len(t_s), 3))
    value, before = rng.normal(size=3), t_s[0]
    for i, now in enumerate(t_s):
        kept = np.exp(-(now - before) / DRIFT_TAU_S)
        value, before = kept * value + np.sqrt(1 - kept**2) * rng.normal(size=3), now
        found[i] = value * DRIFT_DPS
    return found


def campaign(unit: Unit, bench: Bench, rng: np.random.Generator) -> Recording:
    """Return means of one minute over three mountings, all temperatures and rates, by what the bench indicates."""
    rows = [(up, warm, rate) for up in range(3) for warm in WARM_C for rate in rng.permutation(RATES)]
    n = len(rows)
    t_s = 75.0 * np.arange(n) + 5400.0 * np.repeat(np.arange(n // len(RATES)), len(RATES))
    warm = np.array([row[1] for row in rows]) + rng.normal(0, 0.02, n)
    clean = np.array([unit.output(bench.true_rate(row[2], row[0]), at) for row, at in zip(rows, warm, strict=True)])
    output = clean + rng.normal(0, WHITE_DPS, (n, 3)) + drift(t_s, rng) + rng.normal(0, TURN_ON_DPS, 3)
    columns: dict[str, NDArray[np.generic]] = {
        "dataset": np.arange(1, n + 1), "t_s": t_s, "run": np.ones(n, dtype=np.int64),
        "position": np.array([AXES[row[0]] for row in rows]), "table_rate_dps": np.array([row[2] for row in rows]),
        "chamber_c": warm + bench.warm_c, "n": np.full(n, 100),
    }  # fmt: skip
    for number, axis in enumerate(AXES):
        columns |= {f"gyro_{axis}": output[:, number], f"gyro_{axis}_std": np.full(n, 10 * WHITE_DPS)}
    info = RecordingInfo(
        serial="BUDGET", axes=AXES, kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC), max_rate_dps=100,
        standards=STANDARDS, datasheet={"bias_stability_dps": 2 * TURN_ON_DPS},
    )  # fmt: skip
    return Recording(info, columns)


def scores(seed: int) -> dict[str, list[float]]:
    """Return what was compared -> errors over U, of one campaign; also over the U of a bench that states nothing."""
    rng = np.random.default_rng(seed)
    unit, bench = Unit.of(rng), Bench.of(rng)
    recording = with_temperature(campaign(unit, bench, rng))
    data, preset = fit_data_of(recording), preset_for(None, list(MODEL))
    result, evidence = fit_preset(data, preset), use_evidence(data, preset)
    stated = conditions_of(recording.info, result.environment)
    later = rng.normal(0, TURN_ON_DPS, 3) + rng.normal(0, DRIFT_DPS, 3)
    found: defaultdict[str, list[float]] = defaultdict(list)
    for prefix, conditions in (("", stated), (UNSTATED, replace(stated, standards=()))):
        known = {"evidence": evidence, "name": "unit", "bench": conditions}
        for warm, rate in product(AT_C, AT_DPS):
            claimed = rate_uncertainty(result.fitted, rate, warm, **known)  # type: ignore[arg-type]
            key = f"{prefix}corrected rate, {rate:+.0f} deg/s, {warm:+.0f} deg C"
            for number, axis in enumerate(AXES):
                true = np.zeros(3)
                true[number] = rate
                corrected = _corrected(result.fitted, unit.output(true, warm) + later, warm)
                found[key].append(float(corrected[number] - rate) / (claimed[axis].expanded_dps or np.nan))
        budgets = coefficient_budgets(result.fitted, 20.0, **known)  # type: ignore[arg-type]
        gain, offset = unit.gain(20.0), unit.offset(20.0) + later
        for row, axis in enumerate(AXES):
            for name, budget in budgets[axis].items():
                kind = "misalignment" if name.startswith("misalignment") else name
                column = AXES.index(name[-1]) if kind == "misalignment" else row
                true_value = float(offset[row] if kind == "bias" else gain[row, column])
                found[prefix + kind].append(((budget.value or 0.0) - true_value) / (budget.expanded or np.nan))
    return dict(found)


def _corrected(fitted: FittedModel, output: Array, warm: float) -> Array:
    columns = {"temperature_c": np.array([warm]), "table_rate_dps": np.zeros(1), "position": np.array(["z"])}
    outputs = {axis: output[number : number + 1] for number, axis in enumerate(AXES)}
    found = fitted.compensate(outputs, Channels(columns, outputs))
    return np.array([found[axis][0] for axis in AXES])


def share(errors: Array) -> str:
    """Return the share inside of U of errors (campaigns, each), with its 95 % interval by the scatter of campaigns."""
    inside = np.mean(np.abs(errors) <= 1, axis=1)
    half = 1.96 * float(np.std(inside, ddof=1)) / np.sqrt(len(inside))
    middle = float(np.mean(inside))
    return f"{100 * middle:.1f} | {100 * (middle - half):.1f} to {min(100 * (middle + half), 100):.1f}"


def run(campaigns: int = CAMPAIGNS) -> str:
    """Return the shares of errors inside U, of coefficients and of the corrected rate."""
    seeds = range(FIRST_SEED, FIRST_SEED + campaigns)
    if WORKERS > 1:
        with ProcessPoolExecutor(max_workers=WORKERS) as pool:
            each = list(pool.map(scores, seeds, chunksize=5))
    else:
        each = [scores(seed) for seed in seeds]
    found = {key: np.array([one[key] for one in each]) for key in each[0]}
    places = {(warm, rate): f"corrected rate, {rate:+.0f} deg/s, {warm:+.0f} deg C" for warm in AT_C for rate in AT_DPS}
    for prefix in ("", UNSTATED):
        found[prefix + "corrected rate"] = np.concatenate([found[prefix + key] for key in places.values()], axis=1)
    lines = [
        f"| {campaigns} campaigns | inside U, % | 95 % interval | no standards stated: inside U, % |",
        "| --- | --- | --- | --- |",
    ]
    for kind in ("scale_factor", "bias", "misalignment", "corrected rate"):
        without = share(found[UNSTATED + kind]).partition(" | ")[0]
        lines.append(f"| {kind} | {share(found[kind])} | {without} |")
    head = " | ".join(["corrected rate, inside U, %", *(f"{rate:+.0f} deg/s" for rate in AT_DPS)])
    lines += ["", f"| {head} |", "| --- " * (len(AT_DPS) + 1) + "|"]
    for warm in AT_C:
        cells = [share(found[places[warm, rate]]).replace(" | ", " (") + ")" for rate in AT_DPS]
        lines.append(f"| {warm:+.0f} deg C | " + " | ".join(cells) + " |")
    return "\n".join(lines)
