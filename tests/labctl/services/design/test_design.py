"""The designed recipe: it runs, costs what was promised, reaches its goal, and is the cheapest that was tried."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from labctl.answers.calibrations import FitRequest
from labctl.answers.design import DesignRequest, DesignResponse
from labctl.errors import BadInput
from labctl.fitting.models.presets import preset_for
from labctl.recording import to_points
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.design.design import design_campaign
from labctl.services.design.problem import COVERED_K
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import open_store
from procedures.contracts.errors import PlanRefused
from procedures.planning.plan import make_plan
from procedures.recipe.recipe import parse_recipe
from tests.helpers.certificates import AT

#: One axis: a third of the data sets of a tri-axial unit.
BENCH = load_bench("single-axis-sim")
SMALL: dict[str, Any] = {"like": "ojeda2000", "model": "bias_scale"}
_KNOWN: dict[str, DesignResponse] = {}


def designed(**asked: Any) -> DesignResponse:
    key = repr(sorted(asked.items()))
    if key not in _KNOWN:
        _KNOWN[key] = design_campaign(None, DesignRequest.model_validate(SMALL | asked), BENCH)
    return _KNOWN[key]


def test_the_recipe_runs_on_the_bench_as_promised() -> None:
    answer = designed(u_dps=0.01)
    plan = make_plan(parse_recipe(answer.recipe_toml), limits_of(BENCH, driven=True))
    assert plan.schedule_hash == answer.schedule_hash
    assert plan.expected_s / 3600.0 == pytest.approx(answer.chosen.hours)
    assert plan.datasets == answer.chosen.datasets
    fit = plan.recipe.fit
    assert fit is not None
    assert (fit.model, list(fit.effects)) == (answer.model, answer.effects)
    preset_for(fit.model, list(fit.effects))


def test_it_reaches_the_goal_and_nothing_that_was_tried_is_cheaper() -> None:
    answer = designed(u_dps=0.01)
    assert answer.is_reached
    assert answer.chosen.is_reaching
    assert answer.chosen.u_worst_dps <= 0.01
    assert answer.chosen.u_rms_dps <= answer.chosen.u_worst_dps
    assert all(each.hours >= answer.chosen.hours for each in answer.others if each.is_reaching)
    assert answer.reference_name == "ojeda2000"
    assert answer.reference is not None
    assert len(answer.decisions) >= 5
    low_c, high_c = answer.chosen.covered_c
    assert low_c <= 25.0 + COVERED_K
    assert high_c >= 45.0 - COVERED_K


def test_a_smaller_u_takes_longer_and_is_never_below_the_bound() -> None:
    loose, tight = designed(u_dps=0.01), designed(u_dps=0.003)
    assert tight.chosen.hours > loose.chosen.hours
    for answer in (loose, tight):
        assert answer.bound is not None
        assert answer.bound.bound_h == max(answer.bound.noise_h, answer.bound.heat_h)
        assert answer.chosen.hours == pytest.approx(answer.bound.ratio * answer.bound.bound_h)
        assert answer.bound.ratio > 1.0


@pytest.mark.slow
def test_within_hours_it_is_the_best_and_within_too_few_it_is_not_reached() -> None:
    within = designed(hours=2.0)
    assert within.chosen.hours <= 2.0
    assert within.is_reached
    assert all(each.u_worst_dps >= within.chosen.u_worst_dps for each in within.others if each.hours <= 2.0)
    few = designed(hours=2.0, u_dps=1e-5)
    assert not few.is_reached
    assert "no recipe found reaches 1e-05 deg/s within 2 h" in few.decisions[0]
    with pytest.raises(BadInput, match=r"hours = 0\.1 h: the shortest recipe found takes"):
        designed(hours=0.1)


def test_a_table_over_temperature_is_measured_at_fixed_temperatures_and_a_law_while_they_move() -> None:
    element = BENCH.gyros[0].model_copy(update={"technology": "mems"})  # its thermometer is beside it
    bench, wide = BENCH.model_copy(update={"gyros": (element,)}), {"temperatures_c": (-20.0, 60.0), "u_dps": 0.01}
    table, law = (
        design_campaign(None, DesignRequest.model_validate(SMALL | wide | {"model": model}), bench)
        for model in ("weiss1995", "bias_scale")
    )
    assert parse_recipe(table.recipe_toml).ramp is None
    assert "the model is a table over temperature" in " ".join(table.decisions)
    assert parse_recipe(law.recipe_toml).ramp is not None
    assert law.effects == ["temperature_rate"]
    assert law.chosen.hours < table.chosen.hours


@pytest.mark.slow
def test_without_a_recipe_the_range_is_that_of_bench_and_unit() -> None:
    answer = design_campaign(None, DesignRequest(model="bias_scale", hours=6.0), BENCH)
    (gyro,), table = BENCH.gyros, BENCH.table
    assert table is not None
    assert answer.rates_dps[1] == min(gyro.max_rate_dps, table.max_rate_dps)
    assert answer.temperatures_c == (gyro.min_c, gyro.max_c)
    assert parse_recipe(answer.recipe_toml).positions == ("z",)


@pytest.mark.parametrize(
    ("asked", "error", "said"),
    [
        ({"rates_dps": (-900.0, 900.0)}, PlanRefused, r"rates 900 deg/s: beyond the"),
        ({"temperatures_c": (-90.0, 20.0)}, PlanRefused, r"temperatures -90 deg C: outside"),
        ({"model": "poses"}, BadInput, r"no campaign on a rate table is designed for it"),
        ({"model": "sundial"}, BadInput, r"error model 'sundial' is not known"),
        ({"like": "by-hand"}, BadInput, r"turns by hand need no table"),
    ],
)
def test_what_cannot_be_designed_says_why(asked: dict[str, Any], error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        designed(u_dps=0.01, **asked)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({}, "neither u_dps"),
        ({"u_dps": 0.01, "rates_dps": (5.0, -5.0)}, "rates_dps: 5 is not below -5"),
    ],
)
def test_a_request_that_asks_for_nothing_is_refused(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        DesignRequest.model_validate(SMALL | asked)


@pytest.mark.slow
def test_an_earlier_calibration_states_the_noise(tmp_path: Any) -> None:
    gyro = BENCH.gyros[0].model_copy(update={"sample_rate_hz": 4.0})
    plan = make_plan(load_recipe("ojeda2000-121"), limits_of(BENCH))
    recording = to_points(hidden_recording(plan, BENCH, gyro, 3, {}))
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(recording, AT)
        request = DesignRequest.model_validate(SMALL | {"hours": 2.0, "prior": [gyro.serial]})
        with pytest.raises(BadInput, match="has no calibration, so that nothing is known"):
            design_campaign(store, request, BENCH)
        fit_unit(store, gyro.serial, FitRequest(model="bias_scale"), AT)
        answer = design_campaign(store, request, BENCH)
    assert sum(f"from {gyro.serial} version 1" in each for each in answer.assumptions) == 3
    assert answer.chosen.u_worst_dps != designed(hours=2.0).chosen.u_worst_dps


@pytest.mark.slow
def test_a_drift_by_the_data_sheet_of_an_earlier_calibration_has_no_time_constant(tmp_path: Any) -> None:
    """It was stored as 1 s, so that a plan averaged it over its data sets."""
    plan = make_plan(load_recipe("ojeda2000-121"), limits_of(BENCH))
    whole = to_points(hidden_recording(plan, BENCH, BENCH.gyros[0], 3, {}))
    few = replace(whole, columns={name: values[:15] for name, values in whole.columns.items()})
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(few, AT)
        fit_unit(store, few.info.serial, FitRequest(model="single_temperature"), AT)
        request = DesignRequest.model_validate(SMALL | {"hours": 2.0, "prior": [few.info.serial]})
        (drift,) = (each for each in design_campaign(store, request, BENCH).assumptions if each.startswith("drift"))
    assert "(assumed)" in drift
