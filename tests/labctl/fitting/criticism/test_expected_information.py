"""Expected information of a planned recording: joined as a real one would be, and no more than there is to learn."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting.criticism import (
    Criticism,
    OpenQuestion,
    ReducedRecording,
    criticise,
    forecast,
    open_question,
    reduce_recording,
)
from labctl.fitting.criticism.evidence.drawn_shifts import size_average_nats
from labctl.fitting.criticism.planned_addition import with_planned
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.fitting.models.presets import preset_for
from labctl.services.planning.loading import limits_of, load_bench
from labctl.services.simulation.walks import walked
from procedures.experiments import all_blocks
from procedures.planning.plan import make_plan
from tests.helpers.simulated_recordings import plan_on, single_axis, three_axes

#: Under the published schedule like a cubic, and like missed steps.
SATURATION = {"saturation": -7e-4}


@lru_cache(maxsize=1)
def _found() -> Criticism:
    recording = single_axis(3, **SATURATION)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    return criticise(recording, model, full=False)


def _question() -> OpenQuestion:
    question = open_question(_found())
    assert question is not None
    return question


@lru_cache(maxsize=8)
def _planned(block_id: str) -> ReducedRecording:
    plan, bench = plan_on("ojeda2000-121", "single-axis-sim")
    changed = next(block for block in all_blocks() if block.id == block_id).changed(plan.recipe)
    assert changed is not None
    return reduce_recording(walked(make_plan(changed, limits_of(bench)), bench), outliers=False)


def test_a_planned_recording_is_joined_as_a_measured_one() -> None:
    first, plan_bench = single_axis(3), load_bench("single-axis-sim")
    plan, _ = plan_on("ojeda2000-121", "single-axis-sim")
    changed = next(block for block in all_blocks() if block.id == "top_rates").changed(plan.recipe)
    assert changed is not None
    second = walked(make_plan(changed, limits_of(plan_bench)), plan_bench)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(first))
    real = reduce_recording(joined_recording({0: first, 1: second}), outliers=False)
    made = with_planned(reduce_recording(first, outliers=False), reduce_recording(second, outliers=False), model)
    assert len(made) == len(real)
    for name in ("run", "mounting", "recording", "t_s", "recording_t_s", "table_rate_dps", "temperature_c"):
        mean = [data.at_sets(np.asarray(data.nodes[name], dtype=np.float64)) for data in (made, real)]
        assert mean[0] == pytest.approx(mean[1], abs=5.0 if name.endswith("t_s") else 0.02), name
    assert made.nodes.history.numbers("run") == real.nodes.history.numbers("run")
    for number, course in real.nodes.history.profiles.items():
        assert made.nodes.history.profiles[number].begin_s == pytest.approx(course.begin_s, abs=5.0)


def test_the_experiment_that_shows_the_difference_has_the_information() -> None:
    question = _question()
    assert {"saturation", "missed_steps"} <= set(question.ids)
    top, at_rest = forecast(question, _planned("top_rates")), forecast(question, _planned("at_rest"))
    assert top.information_bit > 0.5 * question.entropy_bit
    assert top.information_bit <= question.entropy_bit + 2 * top.u_bit
    assert abs(at_rest.information_bit) < 0.02
    assert (at_rest.names_one, at_rest.distinguished) == (0.0, ())
    assert top.names_one > 0.5
    assert top.names_wrong < 0.05
    assert {"saturation", "missed_steps"} & set(top.distinguished)


def test_a_forecast_is_the_same_again() -> None:
    assert forecast(_question(), _planned("top_rates")) == forecast(_question(), _planned("top_rates"))


@pytest.mark.slow
def test_whether_a_weak_effect_is_missing_is_a_question_beside_an_adequate_model() -> None:
    recording = single_axis(61002, supply_sensitivity=0.0233)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    found = criticise(recording, model, full=False)
    assert found.verdict.form == "adequate"
    question = open_question(found)
    assert question is not None
    assert question.effects[0] == "supply_sensitivity"
    assert "nothing" in question.ids
    nothing = question.probabilities[question.ids.index("nothing")]
    assert 0.2 < nothing < 0.9  # a lead of some nats of one of some thirty effects
    long, short = forecast(question, _planned("loop")), forecast(question, _planned("few_rates"))
    assert long.information_bit > short.information_bit
    assert long.names_wrong < 0.1


@pytest.mark.slow
def test_a_mounting_that_is_still_to_come_is_foreseen_to_shift_as_those_before() -> None:
    recording = three_axes(5, mounting_shift=0.03)
    model, _ = preset_for("yang2018", []).build(fit_data_of(recording))
    question = open_question(criticise(recording, model, full=False))
    assert question is not None
    assert {"mounting_shift", "run_shift"} <= set(question.ids)
    plan, bench = plan_on("table1-x-table2", "triaxial-sim")
    foreseen = {}
    for name in ("upside_down", "power_cycles"):
        changed = next(block for block in all_blocks() if block.id == name).changed(plan.recipe)
        assert changed is not None
        walk = walked(make_plan(changed, limits_of(bench)), bench)
        foreseen[name] = forecast(question, reduce_recording(walk, outliers=False))
    assert foreseen["upside_down"].information_bit > 0.8 * question.entropy_bit
    assert foreseen["upside_down"].names_one > 0.5
    of_runs = foreseen["power_cycles"]  # in one mounting: they show whether it is the runs, and nothing else
    assert of_runs.distinguished == ("run_shift",)
    assert of_runs.information_bit < 0.6 * question.entropy_bit
    assert of_runs.names_one < 0.2


def test_nothing_is_open_where_one_effect_is_named() -> None:
    recording = single_axis(4)
    model, _ = preset_for("ojeda2000", []).build(fit_data_of(recording))
    assert open_question(criticise(recording, model, full=False)) is None


def test_a_recording_of_changing_rates_is_not_joined() -> None:
    data = _planned("top_rates")
    moved = ReducedRecording(
        data.info.model_copy(update={"motion": "profile"}), data.nodes, data.weights, data.waves, data.output,
        data.present, data.white_var, data.dataset,
    )  # fmt: skip
    with pytest.raises(BadInput, match="cannot be fitted together"):
        with_planned(data, moved, _question().comparison.model)


def test_a_ramp_is_not_joined_beside_a_table_over_the_temperature() -> None:
    first = single_axis(3)
    table, _ = preset_for("yang2018", []).build(fit_data_of(first))
    surface, _ = preset_for("ojeda2000", []).build(fit_data_of(first))
    measured = reduce_recording(first, outliers=False)
    assert len(with_planned(measured, _planned("ramp_at_rest"), surface)) > len(measured)
    with pytest.raises(BadInput, match="plan them at these temperatures"):
        with_planned(measured, _planned("ramp_at_rest"), table)


def test_the_evidence_of_a_size_that_is_averaged_over_is_of_the_gain_of_each_effect() -> None:
    comparison = _found().comparison
    assert comparison is not None
    (axis,) = comparison.designs
    options, evidence = [o.candidate for o in comparison.designs[axis].options], comparison.axes[axis]
    by_one_shape = [c for c in comparison.candidates if options.count(c.id) == 1]
    assert len(by_one_shape) > 3
    for candidate in by_one_shape:
        i = candidate.option[axis]
        averaged = size_average_nats(evidence.gain[i], evidence.dimensions[i], float(len(comparison.data)))
        assert candidate.size_nats == pytest.approx(float(averaged), abs=1e-9), candidate.id
