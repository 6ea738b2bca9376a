"""The campaigns of the criticism study: four protocols, effects at a size z, outliers and missing data sets."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from instruments.bench import BenchFile, GyroSettings
from instruments.ports import hidden_defaults
from labctl.errors import BadInput
from labctl.recording import Recording
from labctl.services.planning import limits_of, load_bench, load_recipe
from labctl.services.sizing import Sizing, hidden_recording
from procedures.plan import Plan, make_plan

#: name -> recipe, bench, readings per second, whether re-ordered
PROTOCOLS = {
    "O": ("ojeda2000-121", "single-axis-sim", 10.0, False),
    "O+": ("ojeda2000-121", "single-axis-sim", 10.0, True),
    "Y": ("table1-x-table2", "triaxial-sim", 4.0, False),
    "Y+": ("table1-x-table2", "triaxial-sim", 4.0, True),
}
MODELS = {"O": "ojeda2000", "O+": "ojeda2000", "Y": "yang2018", "Y+": "yang2018"}
#: Less of an effect than this beside the model, and the protocol cannot show it.
LEAST_VISIBLE = 0.15
#: No effect of the catalogue.
OUTSIDE = {"outside_etalon": "temperature_c"}
#: What is known and taken off (the Earth), what a mean of many noisy readings hides whatever its size, or what changes
#: the thermometer and so everything.
NOT_DRAWN = frozenset(
    {"earth_rate", "quantization", "self_heating", "thermometer_error", "bias", "scale_factor", "table_rate_ratio"}
)
#: On one axis a tilt of the gyro is only seen by the Earth, and is then called so.
ONE_AXIS_NOT = frozenset({"misalignment", "non_orthogonality", "cross_axis_nonlinearity"})


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


def sizes(name: str, z_levels: tuple[float, ...], cache: Path) -> dict[str, dict[str, float]]:
    """Return effect -> z -> size, of every effect that the protocol can show; worked out once and kept."""
    kept = cache / f"sizes-{name.replace('+', 'plus')}.json"
    if kept.exists():
        return dict(json.loads(kept.read_text()))
    p = protocol(name)
    sizing = Sizing(p.plan, p.bench, p.gyro)
    found: dict[str, dict[str, float]] = {}
    for effect, default in sorted(hidden_defaults().items()):
        if effect in NOT_DRAWN or (len(p.gyro.axes) == 1 and effect in ONE_AXIS_NOT):
            continue
        at, share = sizing.z_of(effect, default)
        if share < LEAST_VISIBLE or at <= 0:
            continue
        try:
            size, by_z = default * min(z_levels[0] / at, 1e3), {}
            for z in z_levels:
                size = by_z[f"{z:g}"] = sizing.size_of(effect, z, size)
                size *= 3.0
        except BadInput:
            continue
        found[effect] = by_z
    cache.mkdir(parents=True, exist_ok=True)
    kept.write_text(json.dumps(found, indent=1))
    return found


def campaign(
    name: str, seed: int, hidden: dict[str, float], *, outliers: float = 0.0, missing: float = 0.0, drift: float = 1.0
) -> Recording:
    """Return a recording of a protocol; `outliers` and `missing` are shares of readings and of data sets."""
    p = protocol(name)
    gyro = p.gyro
    bench = p.bench
    if drift != 1.0:
        assert bench.simulation is not None
        units = {gyro.name: {"instability_factor": drift}}
        bench = bench.model_copy(update={"simulation": bench.simulation.model_copy(update={"units": units})})
    recording = hidden_recording(p.plan, bench, gyro, seed, hidden)
    if not outliers and not missing:
        return recording
    rng = np.random.default_rng([seed, 99])
    columns = dict(recording.columns)
    dataset = np.asarray(columns["dataset"])
    kept = ~np.isin(dataset, rng.choice(np.unique(dataset), round(missing * len(np.unique(dataset))), replace=False))
    columns = {key: values[kept] for key, values in columns.items()}
    for axis in gyro.axes:
        values = np.array(columns[f"gyro_{axis}"])
        hit = rng.random(len(values)) < outliers
        values[hit] += rng.choice([-1.0, 1.0], hit.sum()) * rng.uniform(5, 50, hit.sum())
        columns[f"gyro_{axis}"] = values
    return Recording(recording.info, columns, recording.environment)
