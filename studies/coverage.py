"""The yang2018 fit's errors against the simulated K and B, in units of its own standard uncertainty.

Every seed is another unit on another campaign of `table1-x-table2`, with noise, drift, the Earth, self-heating and the
table's step errors. A fit whose uncertainties are honest has 68 % of its errors within one and 95 % within two.
`LABCTL_STUDY_UNITS` is the number of seeds.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from numpy.typing import NDArray

from instruments.bench_config import SimulationSettings
from instruments.clock import VirtualClock
from instruments.simulation import open_simulation
from labctl.fitting import fit
from labctl.fitting.estimation.result import FitResult
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import simulate
from procedures.planning.plan import make_plan

SEEDS = int(os.environ.get("LABCTL_STUDY_UNITS", "120"))
RATE_HZ = 10.0


def scores(seed: int) -> NDArray[np.float64]:
    """Return (found - true) / u of every coefficient at every temperature of one seed's unit."""
    bench = load_bench("triaxial-sim")
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": RATE_HZ})
    settings = (bench.simulation or SimulationSettings()).model_copy(update={"seed": seed})
    bench = bench.model_copy(update={"gyros": (gyro,), "simulation": settings})
    plan = make_plan(load_recipe("table1-x-table2"), limits_of(bench))
    result = fit(simulate(plan, bench, gyro), "yang2018")
    truth = open_simulation(bench, VirtualClock()).world.gyro(gyro.name).truth
    nodes = result.fitted.model.temperature.nodes_c  # type: ignore[union-attr]
    k = np.array([truth.k(t) for t in nodes]) - np.eye(3)
    b = np.array([truth.b(t) for t in nodes])
    return np.concatenate([_axis_scores(result, axis, k[:, row], b[:, row]) for row, axis in enumerate("xyz")])


def _axis_scores(result: FitResult, axis: str, k: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    found = result.fitted.axes[axis]
    own = {"bias": b, "scale_factor": k[:, "xyz".index(axis)]}
    parts = [
        (values - (own[name] if name in own else k[:, "xyz".index(name[-1])])) / u
        for name, values, u in zip(found.names, found.values, found.u, strict=True)
    ]
    return np.concatenate(parts)


def run() -> str:
    """Return the shares within one and two standard uncertainties, over all seeds."""
    with ProcessPoolExecutor(max_workers=2) as pool:
        z = np.abs(np.concatenate(list(pool.map(scores, range(1, SEEDS + 1)))))
    return (
        f"{len(z)} coefficients of {SEEDS} units: {100 * np.mean(z < 1):.1f} % of the errors within one standard "
        f"uncertainty, {100 * np.mean(z < 2):.1f} % within two; the worst is {z.max():.2f}"
    )
