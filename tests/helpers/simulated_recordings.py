"""Recordings of the simulated benches, with effects hidden in the gyro."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from labctl.recording import Recording
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import make_plan


@lru_cache(maxsize=4)
def plan_on(recipe: str, bench_name: str) -> Any:
    """Return the plan of a shipped recipe, and the bench."""
    bench = load_bench(bench_name)
    return make_plan(load_recipe(recipe), limits_of(bench)), bench


def single_axis(seed: int = 1, **hidden: float) -> Recording:
    """Return samples at 5 Hz of 121 points about one axis, with these effects and sizes hidden."""
    plan, bench = plan_on("ojeda2000-121", "single-axis-sim")
    return hidden_recording(plan, bench, bench.gyros[0].model_copy(update={"sample_rate_hz": 5.0}), seed, hidden)


def three_axes(seed: int = 1, **hidden: float) -> Recording:
    """Return samples at 2 Hz about three axes, 10 temperatures by 21 rates, with these effects hidden."""
    plan, bench = plan_on("table1-x-table2", "triaxial-sim")
    return hidden_recording(plan, bench, bench.gyros[0].model_copy(update={"sample_rate_hz": 2.0}), seed, hidden)
