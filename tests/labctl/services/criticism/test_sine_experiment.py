"""A sine of rates as the next experiment: where slow ramps cannot tell a delay from a bandwidth."""

from __future__ import annotations

from functools import lru_cache

import pytest

from instruments.bench_config import BenchFile
from labctl.fitting.criticism import Criticism, criticise, open_question
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from labctl.services.criticism.next_experiment import ranked_experiments
from labctl.services.planning.loading import limits_of, load_bench
from labctl.services.simulation.plan_simulation import hidden_recording
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe, parse_recipe

RAMPS = """
name = "slow-ramps"
temperatures_c = [25]
rates_dps = [0]
positions = ["z"]
[[profiles]]
kind = "ramp"
from_dps = -50
to_dps = 50
duration_s = 30
[[profiles]]
kind = "ramp"
from_dps = 50
to_dps = -50
duration_s = 30
[soak]
hold_s = 7200
timeout_s = 14400
[acquire]
duration_s = 30
"""
EFFECTS = ["bias", "scale_factor", "scale_factor_odd", "scale_factor_even"]


@lru_cache(maxsize=1)
def _bench() -> BenchFile:
    """The servo table, 100 readings per second, and an encoder without noise: as one, it would be filtered too."""
    bench = load_bench("servo-sim")
    assert bench.simulation is not None
    quiet = bench.simulation.model_copy(update={"table": {**bench.simulation.table, "encoder_noise_deg": 0.0}})
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 100.0})
    return bench.model_copy(update={"gyros": (gyro,), "simulation": quiet})


def _measured(plan: Plan, effect: str) -> Recording:
    return hidden_recording(plan, _bench(), _bench().gyros[0], 5, {effect: 0.01})


def _criticised(*parts: Recording) -> Criticism:
    recording = joined_recording(dict(enumerate(parts, start=1)))
    model, _ = preset_for(None, EFFECTS).build(fit_data_of(recording))
    return criticise(recording, model, full=False)


@pytest.mark.slow
@pytest.mark.parametrize(("effect", "parameter"), [("time_delay", "delay_s"), ("bandwidth", "time_constant_s")])
def test_a_sine_tells_a_delay_from_a_bandwidth_as_it_was_foreseen(effect: str, parameter: str) -> None:
    recipe: Recipe = parse_recipe(RAMPS)
    first = _measured(make_plan(recipe, limits_of(_bench(), driven=True)), effect)
    question = open_question(_criticised(first))
    assert question is not None
    assert set(question.ids) == {"time_delay", "bandwidth"}
    best = ranked_experiments(question, recipe, _bench())[0]
    assert best.block.id == "sine"
    assert best.forecast.information_bit > 0.9
    assert best.forecast.names_one - best.forecast.names_wrong > 0.9
    verdict = _criticised(first, _measured(best.plan, effect)).verdict
    assert (verdict.form, verdict.named) == ("missing", (effect,))
    assert verdict.terms[effect].parameters[parameter] == pytest.approx(0.01, rel=0.01)
