"""The forecast of a plan by the campaigns that a bench has run, in the database."""

from __future__ import annotations

from pathlib import Path

import pytest
import tomli_w

from instruments.bench_config import BenchFile
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.planning.earlier_campaigns import times_on_bench
from labctl.services.planning.loading import load_bench
from labctl.services.planning.plan_answer import describe_plan
from labctl.store import Store, open_store

RECIPE = """format = "labctl-recipe/1"
name = "four-levels"
temperatures_c = [25, 60, 10, 40]
order = "temperature-major"
rates_dps = [0, 20]
positions = ["z"]
[soak]
hold_s = 60
max_drift_c = 10.0
drift_window_s = 60
[acquire]
duration_s = 2
settle_s = 1
"""


def campaign(store: Store, bench: BenchFile) -> float:
    """Run the recipe; returns how long its moves of the chamber took, s."""
    prepared = prepare(store, RECIPE, bench, VirtualClock(), clip=False)
    assert run(store, prepared).state == "done"
    steps = store.campaigns.steps(prepared.id)
    return sum((s.ended_s or 0.0) - (s.started_s or 0.0) for s in steps if s.kind == "move_chamber")


def moves_s(store: Store, bench: BenchFile) -> float:
    prepared = prepare(store, RECIPE, bench, VirtualClock(), clip=False)
    prepared.bench.close()
    return sum(step.expected_s for step in store.campaigns.steps(prepared.id) if step.kind == "move_chamber")


def slow_bench() -> BenchFile:
    """Return a bench whose chamber follows much more slowly than its file says."""
    record = load_bench("single-axis-sim").model_dump(mode="json", exclude_none=True)
    record["name"] = "slow"
    record["chamber"]["air_tau_s"] = 30.0
    record["simulation"].setdefault("chamber", {})["air_tau_s"] = 900.0
    return resolve(BenchFile.model_validate(record))


@pytest.mark.slow
def test_the_second_campaign_on_a_bench_is_expected_to_take_what_the_first_took(tmp_path: Path) -> None:
    bench = slow_bench()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        assert times_on_bench(store, bench) is None
        before_s, took_s, after_s = moves_s(store, bench), campaign(store, bench), moves_s(store, bench)
        assert before_s < 0.6 * took_s
        assert after_s == pytest.approx(took_s, rel=0.2)
        earlier = times_on_bench(store, bench)
        assert earlier is not None
        assert earlier.campaigns == 1
        assert times_on_bench(store, bench.model_copy(update={"name": "other"})) is None
        chamber = bench.chamber
        assert chamber is not None
        faster = bench.model_copy(update={"chamber": chamber.model_copy(update={"ramp_c_per_min": 9.0})})
        known = times_on_bench(store, faster)
        assert known is not None
        assert (known.home_s, known.heating, known.cooling) == (earlier.home_s, None, None)  # another chamber now


@pytest.mark.slow
def test_a_plan_says_what_it_takes_from_earlier_campaigns_and_what_it_guesses(tmp_path: Path) -> None:
    path, recipe = tmp_path / "bench.toml", tmp_path / "recipe.toml"
    bench = slow_bench()
    record = bench.model_dump(mode="json", exclude_none=True, exclude={"drivers", "reported"})
    path.write_text(tomli_w.dumps(record), encoding="utf-8")
    recipe.write_text(RECIPE, encoding="utf-8")
    first = describe_plan(str(recipe), str(path), clip=False)
    assert (first.guessed, first.learned) == (["homing takes 30 s"], [])
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        for _ in range(2):
            campaign(store, bench)
        then = describe_plan(str(recipe), str(path), clip=False, store=store)
    assert then.guessed == []
    assert then.schedule_hash == first.schedule_hash
    assert all("from 2 campaigns on this bench" in text for text in then.learned)
    assert [text.split(" ")[0] for text in then.learned] == ["homing", "the", "the"]
    assert ("chamber heats by" in then.learned[1], "cools" in then.learned[2]) == (True, True)
    assert then.expected_s > first.expected_s
