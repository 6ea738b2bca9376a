"""A hidden effect of the supply voltage: silent at a constant voltage, named alone after the block of supply steps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from instruments.bench_config import BenchFile, read_bench
from labctl.fitting.criticism import criticise, open_question
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.criticism.next_experiment import Planned, plans_of, ranked_experiments
from labctl.services.planning.loading import load_bench, load_recipe, with_drivers
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.experiments import BLOCKS
from procedures.planning.plan import Plan
from procedures.recipe.recipe import parse_recipe, recipe_document
from studies.campaigns import MODELS, campaign
from tests.helpers.lab import Lab
from tests.helpers.supplied_bench import with_supply

EFFECT, SIZE = "supply_sensitivity", 0.05
STANDARD: dict[str, Any] = {
    "name": "standard",
    "temperatures_c": [20, 30, 40],
    "rates_dps": [-100, -75, -50, -25, 0, 25, 50, 75, 100],
    "positions": ["z"],
    "repeats": 2,
    "soak": {"hold_s": 1800, "max_drift_c": 0.5, "drift_window_s": 300, "timeout_s": 7200},
    "acquire": {"duration_s": 30, "settle_s": 2},
    "fit": {"model": "ojeda2000"},
}


def bench_of(hidden: dict[str, float]) -> BenchFile:
    return with_drivers(with_supply(read_bench("single-axis-sim"), hidden))


def steps_on(bench: BenchFile) -> Planned:
    """Return the block on a bench, as it is proposed first."""
    return next(each for each in plans_of(load_recipe("ojeda2000"), bench) if each.block.id == "supply_steps")


def test_the_block_is_offered_where_the_bench_has_a_supply() -> None:
    offered = [
        {each.block.id for each in plans_of(load_recipe("ojeda2000"), bench)}
        for bench in (load_bench("single-axis-sim"), bench_of({}))
    ]
    assert offered[1] - offered[0] == {"supply_steps"}
    block = next(block for block in BLOCKS if block.id == "supply_steps")
    assert "[supply] of the bench file" in block.needs[0]


@pytest.mark.slow
def test_the_block_is_the_best_experiment_where_the_effect_is_a_suspect() -> None:
    recording = campaign("O", 600, {EFFECT: 0.03})  # of a supply that is not regulated: its wander shows a little
    model, _ = preset_for(MODELS["O"], []).build(fit_data_of(recording))
    criticism = criticise(recording, model, full=True)
    question = open_question(criticism)
    assert criticism.verdict.form == "adequate"
    assert question is not None
    assert question.effects[0] == EFFECT
    assert len(question.effects) > 1
    best, *others = ranked_experiments(question, load_recipe("ojeda2000"), bench_of({}))
    assert best.block.id == "supply_steps"
    assert best.naming > 0.2
    assert max(each.naming for each in others if each.block.id != "supply_steps") < 0.5 * best.naming


def walk(plan: Plan, hidden: dict[str, float]) -> Recording:
    bench = bench_of({})
    return hidden_recording(plan, bench, bench.gyros[0], 7, hidden)


def test_the_simulated_unit_feels_the_simulated_supply() -> None:
    plan = steps_on(bench_of({})).plan
    plain, felt = walk(plan, {}), walk(plan, {EFFECT: SIZE})
    supply_v = np.asarray(felt.columns["supply_v"], dtype=np.float64)
    assert {4.75, 5.0, 5.25} == set(np.round(supply_v, 2).tolist())
    added = np.asarray(felt.columns["gyro_z"], dtype=np.float64) - np.asarray(plain.columns["gyro_z"], dtype=np.float64)
    assert added == pytest.approx(SIZE * (supply_v - 5.0), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [{EFFECT: SIZE}, {}], ids=["hidden", "nothing hidden"])
def test_a_constant_voltage_is_silent_and_the_steps_name_the_effect_alone(
    tmp_path: Path, hidden: dict[str, float]
) -> None:
    """Both campaigns run on the bytes of the simulated bench, the supply among them."""
    bench, standard, steps = (tmp_path / name for name in ("bench.toml", "standard.toml", "steps.toml"))
    document = bench_of(hidden).model_dump(mode="json", exclude_none=True, exclude={"drivers", "reported"})
    bench.write_text(tomli_w.dumps(document), encoding="utf-8")
    standard.write_text(tomli_w.dumps(STANDARD), encoding="utf-8")
    changed = next(block for block in BLOCKS if block.id == "supply_steps").changed(parse_recipe(standard.read_text()))
    assert changed is not None
    steps.write_text(tomli_w.dumps(recipe_document(changed) | {"name": "supply-steps"}), encoding="utf-8")
    lab = Lab(tmp_path)
    for recipe in (standard, steps):
        lab.run("campaign", "start", str(recipe), "--bench", str(bench))
    alone = lab.json("criticise", "FOG-0001", "--version", "1", "--recording", "1")
    assert (alone["verdict"], alone["named"]) == ("adequate", [])
    together = lab.json("criticise", "FOG-0001", "--version", "1", "--recording", "1,2")
    expected = ("missing", [EFFECT]) if hidden else ("adequate", [])
    assert (together["verdict"], together["named"]) == expected
