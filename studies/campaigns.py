"""The campaigns of the criticism study: four protocols, effects hidden in them, outliers and missing data sets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from instruments.bench_config import BenchFile, GyroSettings, SimulationSettings
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from labctl.recording import Recording
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan, make_plan

#: name -> recipe, bench, readings per second, whether re-ordered
PROTOCOLS = {
    "O": ("ojeda2000-121", "single-axis-sim", 10.0, False),
    "O+": ("ojeda2000-121", "single-axis-sim", 10.0, True),
    "Y": ("table1-x-table2", "triaxial-sim", 4.0, False),
    "Y+": ("table1-x-table2", "triaxial-sim", 4.0, True),
}
MODELS = {"O": "ojeda2000", "O+": "ojeda2000", "Y": "yang2018", "Y+": "yang2018"}
#: No effect of the catalogue.
OUTSIDE = {"outside_etalon": "temperature_c", "outside_humidity": "humidity_pct"}


@dataclass(frozen=True)
class Protocol:
    """A schedule on a simulated bench."""

    name: str
    plan: Plan
    bench: BenchFile
    gyro: GyroSettings


@lru_cache(maxsize=8)
def protocol(name: str) -> Protocol:
    """Return a protocol by name."""
    recipe_name, bench_name, rate_hz, reordered = PROTOCOLS[name]
    recipe, bench = load_recipe(recipe_name), load_bench(bench_name)
    if reordered:
        recipe = recipe.model_copy(update={"temperature_order": "up_down", "rate_order": "random", "seed": 7})
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": rate_hz})
    return Protocol(name, make_plan(recipe, limits_of(bench)), bench, gyro)


def campaign(
    name: str, seed: int, hidden: dict[str, float], *, outliers: float = 0.0, missing: float = 0.0, drift: float = 1.0
) -> Recording:
    """Return a recording of a protocol.

    `outliers` and `missing` are the shares of readings replaced and of data sets left out; `drift` is the bias
    instability over what such a unit has.
    """
    p = protocol(name)
    bench = p.bench if drift == 1.0 else drifting(p.bench, p.gyro, drift)
    recording = hidden_recording(p.plan, bench, p.gyro, seed, hidden)
    return spoiled(recording, seed, outliers, missing) if outliers or missing else recording


def drifting(bench: BenchFile, gyro: GyroSettings, factor: float) -> BenchFile:
    """Return a bench on which a simulated unit's bias instability is `factor` times its own."""
    own = open_simulation(bench, VirtualClock()).world.gyro(gyro.name).truth.instability_dps
    settings = bench.simulation or SimulationSettings()
    unit = {**settings.units.get(gyro.name, {}), "instability_dps": factor * own}
    units = {**settings.units, gyro.name: unit}
    return bench.model_copy(update={"simulation": settings.model_copy(update={"units": units})})


def spoiled(recording: Recording, seed: int, outliers: float, missing: float) -> Recording:
    """Return a recording in which a share of data sets is missing, and a share of readings is far off."""
    rng = np.random.default_rng([seed, 99])
    dataset = np.asarray(recording.columns["dataset"])
    numbers = np.unique(dataset)
    kept = ~np.isin(dataset, rng.choice(numbers, round(missing * len(numbers)), replace=False))
    columns = {key: values[kept] for key, values in recording.columns.items()}
    for axis in recording.info.axes:
        values = np.array(columns[f"gyro_{axis}"])
        hit = rng.random(len(values)) < outliers
        values[hit] += rng.choice([-1.0, 1.0], hit.sum()) * rng.uniform(5, 50, hit.sum())
        columns[f"gyro_{axis}"] = values
    return Recording(recording.info, columns, recording.environment)
