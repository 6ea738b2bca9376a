"""A plan is walked through once: the same question finds the walk in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation import walks
from labctl.services.simulation.visibility import planned_schedule
from procedures.planning.plan import Plan, make_plan


def plan_of(recipe: str) -> Plan:
    return make_plan(load_recipe(recipe), limits_of(load_bench("single-axis-sim")))


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_a_walk_from_a_file_is_the_walk_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, bench = plan_of("short"), load_bench("single-axis-sim")
    made = walks._walk(plan, bench)
    first = walks.walked(plan, bench)
    monkeypatch.setattr(walks, "hidden_recording", None)  # a second walk would call it
    again = walks.walked(plan, bench)
    for kept in (first, again):
        assert kept.info == made.info
        assert made.environment is not None
        assert kept.environment is not None
        for one, other in ((made.columns, kept.columns), (made.environment, kept.environment)):
            assert list(one) == list(other)
            assert all(np.array_equal(one[name], other[name]) for name in one)


def test_short_data_sets_have_enough_readings_to_show_their_noise() -> None:
    recipe = load_recipe("short")
    quick = recipe.model_copy(update={"acquire": recipe.acquire.model_copy(update={"duration_s": 5.0})})
    bench = load_bench("single-axis-sim")
    plan = make_plan(quick, limits_of(bench))
    counts = np.unique(walks.walked(plan, bench).columns["dataset"], return_counts=True)[1]
    assert counts.min() >= walks.MIN_READINGS - 1
    assert planned_schedule(plan, bench).data.white_var is not None


def test_another_plan_or_bench_is_another_walk() -> None:
    bench = load_bench("single-axis-sim")
    short = walks.walked(plan_of("short"), bench)
    assert len(walks.walked(plan_of("gyrostar"), load_bench("single-axis-sim"))) != len(short)
    other = bench.model_copy(update={"gyros": (bench.gyros[0].model_copy(update={"serial": "FOG-9999"}),)})
    assert walks.walked(plan_of("short"), other).info.serial == "FOG-9999"
