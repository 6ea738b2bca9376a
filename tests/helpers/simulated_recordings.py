"""Recordings of the simulated benches, with effects hidden in the gyro."""

from __future__ import annotations

from dataclasses import replace
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


@lru_cache(maxsize=32)
def _made(recipe: str, bench_name: str, rate_hz: float, seed: int, hidden: tuple[tuple[str, float], ...]) -> Recording:
    plan, bench = plan_on(recipe, bench_name)
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": rate_hz})
    return hidden_recording(plan, bench, gyro, seed, dict(hidden))


def _copied(recording: Recording) -> Recording:
    """Return a copy of what many tests begin with and is made once in a process: each may change its own."""
    copied = [
        None if columns is None else {name: values.copy() for name, values in columns.items()}
        for columns in (recording.columns, recording.environment)
    ]
    return replace(recording, columns=copied[0] or {}, environment=copied[1])


def single_axis(seed: int = 1, **hidden: float) -> Recording:
    """Return samples at 5 Hz of 121 points about one axis, with these effects and sizes hidden."""
    return _copied(_made("ojeda2000-121", "single-axis-sim", 5.0, seed, tuple(hidden.items())))


def three_axes(seed: int = 1, **hidden: float) -> Recording:
    """Return samples at 2 Hz about three axes, 10 temperatures by 21 rates, with these effects hidden."""
    return _copied(_made("table1-x-table2", "triaxial-sim", 2.0, seed, tuple(hidden.items())))
