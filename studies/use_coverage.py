"""Coverage of the uncertainty that a calibration promises for use: errors on a later day against U (k = 2).

Simulated units, each with its own laws of temperature and rate, are calibrated in three powered runs, or in one with a
data sheet, by models that are adequate and by models that are not; on a later day, after another power-on and with
another drift, the corrected rate is compared with the truth in the middle, at the edges and at a corner of the range.
The data sheet states one figure by each of its conventions, and the power-ons are drawn from what that one says.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from instruments.datasheet import Convention
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.fitted_model import FittedModel
from labctl.fitting.models.presets import preset_for
from labctl.fitting.uncertainty import rate_uncertainty, use_evidence
from labctl.recording import Recording, RecordingInfo

UNITS = int(os.environ.get("LABCTL_STUDY_USE_UNITS", "200"))
WORKERS = int(os.environ.get("LABCTL_STUDY_USE_WORKERS", "2"))
#: The first seed: none of these units was used while the uncertainty was made.
FIRST_SEED = 1_001
RATES = np.array([-100, -80, -60, -40, -20, 0, 20, 40, 60, 80, 100], dtype=np.float64)
WARM_C = np.arange(-20.0, 61.0, 10.0)
WHITE_DPS, DRIFT_DPS, DRIFT_TAU_S, TURN_ON_DPS = 3e-4, 1e-3, 1800.0, 2e-3
#: What the figure of a data sheet is drawn as: one error of a unit of figure 1.
CONVENTIONS: dict[Convention, Callable[[np.random.Generator], float]] = {
    "1 sigma": lambda rng: rng.normal(),
    "maximum": lambda rng: rng.uniform(-1, 1),
    "peak to peak": lambda rng: rng.uniform(-0.5, 0.5),
    "typical": lambda rng: rng.normal() / 0.67449,  # half of the units are within the figure
}
ADEQUATE = ("bias", "bias_temperature:3", "scale_factor", "scale_factor_temperature:2", "scale_factor_odd")
#: What the model leaves out of the unit's law.
MODELS = {
    "adequate": ADEQUATE,
    "no cubic of rate": ADEQUATE[:-1],
    "bias a parabola": ("bias", "bias_temperature:2", *ADEQUATE[2:]),
    "scale factor constant": (*ADEQUATE[:3], ADEQUATE[-1]),
}
PLACES = {"middle": (30.0, 15.0), "cold": (10.0, -20.0), "warm": (-50.0, 60.0), "fastest": (100.0, 25.0),
          "corner": (-100.0, 60.0), "rest": (0.0, 5.0), "between": (70.0, 38.0)}  # fmt: skip


@dataclass(frozen=True)
class Unit:
    """One unit's law: output minus rate, deg/s."""

    size: NDArray[np.float64]  #: (7,) of its terms

    @staticmethod
    def drawn(rng: np.random.Generator) -> Unit:
        return Unit(rng.normal(size=7) * np.array([0.1, 0.05, 0.02, 5e-3, 1e-3, 1e-4, 1.5e-4]))

    def error_dps(self, rate: NDArray[np.float64], warm: NDArray[np.float64]) -> NDArray[np.float64]:
        u, w = (warm - 20.0) / 40.0, rate / 100.0
        b0, b1, b2, b3, s0, s1, c3 = self.size
        return np.asarray(
            b0 + b1 * u + b2 * u**2 + b3 * u**3 + 100 * w * (s0 + s1 * u + 0.5 * s1 * u**2) + 100 * c3 * w**3
        )


def drift(t_s: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return an Ornstein-Uhlenbeck drift at rising times, deg/s."""
    found = np.empty(len(t_s))
    value, before = rng.normal(), t_s[0]
    for i, now in enumerate(t_s):
        kept = np.exp(-(now - before) / DRIFT_TAU_S)
        value, before = kept * value + np.sqrt(1 - kept**2) * rng.normal(), now
        found[i] = value * DRIFT_DPS
    return found


def campaign(
    unit: Unit,
    runs: int,
    rng: np.random.Generator,
    convention: Convention = "1 sigma",
    levels_c: Sequence[float] = tuple(WARM_C.tolist()),
    turn_on_dps: float | None = None,
) -> Recording:
    """Return means of one minute over all temperatures and rates, the temperatures shared among powered runs.

    `turn_on_dps` is what every run is off by; default: drawn for each.
    """
    parts = []
    for run in range(1, runs + 1):
        levels = np.asarray(levels_c[(run - 1) % runs :: runs] if runs > 1 else levels_c)
        warm = np.repeat(levels, len(RATES)) + rng.normal(0, 0.02, len(levels) * len(RATES))
        rate = np.concatenate([rng.permutation(RATES) for _ in levels])
        t_s = 75.0 * np.arange(len(rate)) + 5400.0 * np.repeat(np.arange(len(levels)), len(RATES)) + 1e6 * run
        noise = rng.normal(0, WHITE_DPS, len(rate)) + drift(t_s, rng)
        noise += TURN_ON_DPS * CONVENTIONS[convention](rng) if turn_on_dps is None else turn_on_dps
        parts.append((t_s, np.full(len(rate), run), rate, warm, rate + unit.error_dps(rate, warm) + noise))
    t_s, number, rate, warm, output = (np.concatenate(column) for column in zip(*parts, strict=True))
    n = len(rate)
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": t_s, "run": number, "position": np.full(n, "z"), "table_rate_dps": rate,
        "temperature_c": warm, "gyro_z": output, "gyro_z_std": np.full(n, 10 * WHITE_DPS), "n": np.full(n, 100),
    }  # fmt: skip
    sheet = {"bias_stability_dps": TURN_ON_DPS}
    info = RecordingInfo(serial="USE", axes=("z",), kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC))
    stated = {"datasheet": sheet, "datasheet_conventions": {"bias_stability_dps": convention}}
    return Recording(info.model_copy(update=stated), columns)


def scores(seed: int) -> dict[tuple[str, str], list[float]]:
    """Return (model and case, place) -> errors on later days over U, of one unit."""
    rng = np.random.default_rng(seed)
    unit, found = Unit.drawn(rng), defaultdict(list)
    cases: list[tuple[int, Convention]] = [(3, "1 sigma"), *((1, convention) for convention in CONVENTIONS)]
    for runs, convention in cases:
        data = fit_data_of(campaign(unit, runs, rng, convention))
        later = TURN_ON_DPS * CONVENTIONS[convention](rng) + rng.normal(0, DRIFT_DPS)
        told = f"{runs} runs" if runs > 1 else f"data sheet: {convention}"
        for name, effects in MODELS.items() if convention == "1 sigma" else (("adequate", ADEQUATE),):
            preset = preset_for(None, list(effects))
            fitted, evidence = fit_preset(data, preset).fitted, use_evidence(data, preset)
            for place, (rate, warm) in PLACES.items():
                output = np.array([rate]) + unit.error_dps(np.array([rate]), np.array([warm])) + later
                rate_dps = corrected(fitted, output, warm)
                claimed = rate_uncertainty(fitted, rate, warm, evidence=evidence, name="unit")["z"].expanded_dps
                assert claimed is not None
                found[f"{name}, {told}", place].append((rate_dps - rate) / claimed)
    return dict(found)


def corrected(fitted: FittedModel, output: NDArray[np.float64], warm: float) -> float:
    """Return the corrected rate of an output (1,) at a temperature, deg/s."""
    columns = {"temperature_c": np.array([warm]), "table_rate_dps": output, "position": np.array(["z"])}
    return float(fitted.compensate({"z": output}, Channels(columns, {"z": output}))["z"][0])


def run(units: int = UNITS) -> str:
    """Return the share of errors within U, by model and place."""
    pooled: dict[tuple[str, str], list[float]] = defaultdict(list)
    with ProcessPoolExecutor(max_workers=WORKERS) as pool:
        for found in pool.map(scores, range(FIRST_SEED, FIRST_SEED + units), chunksize=5):
            for key, values in found.items():
                pooled[key] += values
    head = " | ".join([f"{units} units: within U (k = 2), %", *PLACES, "all"])
    lines = [f"| {head} |", "| --- " * (len(PLACES) + 2) + "|"]
    for row in [*sorted({model for model, _ in pooled}), "all"]:
        chosen = {key: values for key, values in pooled.items() if row in {key[0], "all"}}
        cells = [f"{100 * np.mean(_inside(chosen, (place,))):.1f}" for place in PLACES]
        of_units = _inside(chosen, tuple(PLACES)).mean(axis=0)  # one unit has one power-on for all places
        middle, half = float(of_units.mean()), 1.96 * float(of_units.std(ddof=1)) / np.sqrt(units)
        total = f"{100 * middle:.1f} ({100 * (middle - half):.1f} to {min(100 * (middle + half), 100):.1f})"
        lines.append(f"| {row} | " + " | ".join([*cells, total]) + " |")
    return "\n".join(lines)


def _inside(found: dict[tuple[str, str], list[float]], places: tuple[str, ...]) -> NDArray[np.bool_]:
    """Return whether the errors are within U, (cases, units)."""
    return np.abs([values for (_, place), values in found.items() if place in places]) <= 1
