"""The views of a criticism: each shows what was hidden, and nothing where nothing was."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.diagnostics import VIEWS, draws_of
from labctl.fitting.criticism.diagnostics.channels import groups_of, runs_test
from labctl.fitting.criticism.diagnostics.repeatability import hysteresis_states
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, formulas
from labctl.fitting.models.presets import preset_for
from labctl.recording import read_recording
from labctl.recording.columns import BY_NAME
from tests.helpers.criticism import held, views
from tests.helpers.paths import ROOT
from tests.helpers.recordings import cycled
from tests.helpers.simulated_recordings import single_axis, three_axes


@lru_cache(maxsize=1)
def plain() -> dict[str, Any]:
    return views(single_axis(5))


def of(found: dict[str, Any], channel: str) -> dict[str, Any]:
    return next(line for line in found["channels"] if line["channel"] == channel)


def over(values: list[float], band: list[float]) -> np.ndarray:
    return np.array(values) / np.array(band)


def test_with_nothing_hidden_no_view_shows_anything() -> None:
    found = plain()
    assert found["angle"][0]["lines"] == []
    assert max(line["z"] for line in found["channels"]) < 3
    assert (
        np.mean(np.abs(over(found["time_in_set"][0]["per_step"], found["time_in_set"][0]["per_step_band"])) < 1) > 0.8
    )
    assert abs(found["time"][0]["runs_z"]) < 3
    within = found["frequency_within"][0]
    assert sum(np.array(within["over_white"]) > np.array(within["limit"])) <= 1


def test_once_per_turn_is_a_line_in_the_angle_of_its_size() -> None:
    lines = views(single_axis(5, earth_rate_tilt=0.0012))["angle"][0]["lines"]
    assert [line["cycles_per_turn"] for line in lines] == [1]
    assert lines[0]["amplitude_dps"] == pytest.approx(0.0012, rel=0.25)


def test_the_ripple_of_the_gear_is_a_line_at_four_per_turn() -> None:
    assert [line["cycles_per_turn"] for line in views(single_axis(5, table_rate_ripple=3e-5))["angle"][0]["lines"]] == [
        4
    ]


def test_a_start_transient_is_a_course_per_step_of_rate() -> None:
    found = views(single_axis(5, start_transient=2e-3))["time_in_set"][0]
    ratio = over(found["per_step"], found["per_step_band"])
    assert ratio[0] < -10
    assert np.std(ratio[len(ratio) // 2 :]) < 0.1 * abs(ratio[0])


def test_the_rate_before_shows_its_memory() -> None:
    assert views(single_axis(5, rate_hysteresis=0.005))["previous_rate"][0]["z"] > 4 > plain()["previous_rate"][0]["z"]


def test_asymmetry_bends_the_line_against_the_rate_with_the_sign_of_the_speed() -> None:
    line = of(views(single_axis(5, scale_factor_asymmetry=4e-4)), "table_rate_dps")
    assert line["z"] > 4
    rate, mean = np.abs(line["at"]), np.array(line["mean_dps"])
    assert mean[rate > 70].min() > mean[rate < 20].max()
    assert np.all(np.array(line["low_dps"]) < mean)
    assert np.all(mean < np.array(line["high_dps"]))


def test_up_and_down_legs_differ_by_twice_the_hysteresis() -> None:
    effects = ("bias", "scale_factor")
    by_temperature, by_rate = views(cycled(0.01), None, effects)["legs"]
    assert (by_temperature["channel"], by_rate["channel"]) == ("temperature_c", "table_rate_dps")
    assert (
        by_temperature["pairs"] == 42
    )  # the way to the lowest is not known, and the highest is reached from below only
    assert by_temperature["mean_dps"] == pytest.approx([0.02] * len(by_temperature["mean_dps"]), abs=2e-3)
    assert by_rate["at"] == pytest.approx([-50, -20, 0, 20, 50])
    none = views(cycled(0.0), None, effects)["legs"][0]
    assert none["mean_dps"] == pytest.approx([0.0] * len(none["mean_dps"]), abs=2e-3)


def test_repeats_scatter_as_the_floor_says() -> None:
    found = views(cycled(0.0), None, ("bias", "scale_factor"))["repeats"][0]
    assert found["pairs"] >= 18
    assert found["scatter_dps"] == pytest.approx(5e-4, rel=0.3)
    assert found["over_floor"] == pytest.approx(1.0, abs=0.3)
    assert plain()["repeats"] == []


def test_legs_turn_where_the_temperature_does_and_begin_anew_with_power() -> None:
    warm = np.array([20, 20.5, 25, 30, 29.5, 26, 20, 21, 25, 40, 38])
    run = np.array([1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2])
    assert hysteresis_states(warm, run).tolist() == [0, 0, 1, 1, 1, -1, -1, -1, 1, 0, 0]


def test_few_levels_are_averaged_one_by_one_and_the_rest_in_windows() -> None:
    levels = np.repeat([-400.0, -0.5, -0.25, 0.0, 0.25, 0.5, 400.0], 5)
    assert [len(group) for group in groups_of(levels)] == [5] * 7
    jittered = np.repeat([20.0, 30.0, 40.0], 10) + np.random.default_rng(1).normal(0, 0.1, 30)
    assert [len(group) for group in groups_of(jittered)] == [10, 10, 10]
    assert [len(group) for group in groups_of(np.linspace(0, 1, 120))] == [10] * 24
    assert [len(group) for group in groups_of(np.zeros(9))] == [9]


@pytest.mark.parametrize(("values", "sign"), [(np.sin(np.arange(60) / 8), -1), ((-1.0) ** np.arange(60), 1)])
def test_runs_tell_drift_from_alternation(values: np.ndarray, sign: int) -> None:
    z, p = runs_test(values)
    assert np.sign(z) == sign
    assert p < 1e-6


def test_runs_of_chance_are_no_alarm() -> None:
    alarms = [runs_test(np.random.default_rng(seed).normal(size=100))[1] < 0.05 for seed in range(200)]
    assert 0.01 < np.mean(alarms) < 0.1


def numbers(value: Any) -> int:
    if isinstance(value, dict):
        return sum(numbers(part) for part in value.values())
    return sum(numbers(part) for part in value) if isinstance(value, list) else 1


@pytest.mark.slow
def test_three_axes_are_compact_and_plain_json() -> None:
    found = views(three_axes(4), "yang2018")
    assert set(found) == {
        "sets", "channels", "time", "frequency", "frequency_within", "angle", "time_in_set", "legs", "previous_rate",
        "repeats", "draws",
    }  # fmt: skip
    json.dumps(found, allow_nan=False)
    for name in set(found) - {"sets", "draws"}:
        assert all(numbers(line) <= 1000 for line in found[name]), name
    assert found["sets"]["of"] == 630
    assert sorted(found["sets"]["dataset"]) == list(range(1, 631))
    assert all(len(line["at"]) == 21 for line in found["channels"] if line["channel"] == "table_rate_dps")
    assert {line["position"] for line in found["channels"] if line["channel"] == "table_rate_dps"} == {"x", "y", "z"}
    assert all(
        len(line["lines"]) <= 1 for line in found["angle"]
    )  # the Earth is no surprise where the latitude is known


def test_a_recording_of_means_without_times_has_the_views_that_it_can() -> None:
    found = views(read_recording(ROOT / "examples" / "osu-fog"))
    assert found["angle"] == found["time_in_set"] == found["frequency_within"] == []
    warm = of(found, "temperature_c")["at"]
    assert len(warm) == 24  # no levels: a running mean all along
    assert np.max(np.diff(warm)) < 0.2 * np.ptp(warm)
    assert len(found["time"][0]["order"]) == 24
    assert "t_s" not in {*found["time"][0], *found["sets"]["channels"]}
    assert found["sets"]["channels"]["order"] == list(range(1, found["sets"]["of"] + 1))
    assert "apart_s" not in found["repeats"][0]
    assert found["frequency"] == []
    assert not found["sets"]["timed"]
    assert found["repeats"][0]["pairs"] > 8
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize("left_out", ["table_angle_deg", "power_s", "chamber_c", "run"])
def test_a_channel_that_was_not_kept_is_no_error(left_out: str) -> None:
    recording = single_axis(5)
    found = views(replace(recording, columns={k: v for k, v in recording.columns.items() if k != left_out}))
    assert left_out not in {line["channel"] for line in found["channels"]}
    assert bool(found["angle"]) == (left_out != "table_angle_deg")


def test_only_a_full_criticism_has_views() -> None:
    quick: Criticism = held(single_axis(5))
    assert quick.views == {}
    whole = held(single_axis(5), full=True)
    assert whole.views["sets"]["of"] == 121


def test_too_little_data_has_no_views() -> None:
    recording = single_axis(5)
    few = np.asarray(recording.columns["dataset"]) <= 2
    short = replace(recording, columns={k: v[few] for k, v in recording.columns.items()})
    model, _ = preset_for(None, ["bias", "scale_factor"]).build(fit_data_of(short))
    found = criticise(short, model)
    assert found.verdict.form == "insufficient_data"
    assert found.views == {}


@pytest.mark.parametrize("kind", CATALOGUE.values(), ids=lambda kind: kind.id)
def test_every_effect_says_which_picture_it_draws(kind: Any) -> None:
    assert kind.draws
    assert set(kind.draws) <= {*VIEWS, *BY_NAME}


def test_a_formula_draws_against_its_channels() -> None:
    (wet,) = formulas("wet: (humidity_pct - 40) * rate_dps")
    drawn = draws_of({wet.id: wet}, {"humidity_pct", "table_rate_dps", "supply_v"})
    assert drawn["humidity_pct"] == drawn["table_rate_dps"] == ["wet"]
    assert drawn["supply_v"] == drawn["map"] == []
