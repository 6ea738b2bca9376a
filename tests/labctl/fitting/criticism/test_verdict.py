"""What a verdict may not say: a second name for a remainder, an unphysical one, one that predicts worse."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labctl.fitting.criticism import Criticism, Verdict, criticise
from labctl.fitting.criticism.criticism import _without_weak_names
from labctl.fitting.criticism.model_comparison import compare_models
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.criticism.search.held_out import held_out_rises
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Term
from labctl.fitting.models.presets import changed, preset_for
from labctl.probability_text import odds_text, probability_text
from labctl.recording import Recording, read_recording
from labctl.services.criticism.answer import answer_of, sentences
from labctl.services.simulation.recordings import SimulateRequest, make_recording
from studies.outside_catalogue import KINDS
from tests.helpers.criticism import held
from tests.helpers.simulated_recordings import single_axis, three_axes

EXAMPLES = Path(__file__).parents[4] / "examples"


def made(recipe: str, seed: int = 1, *hide: str) -> Recording:
    return make_recording(SimulateRequest(recipe=recipe, seed=seed, hide=list(hide), sample_rate_hz=4.0)).recording


@pytest.mark.parametrize("model", ["ojeda2000", "bias_scale"])
def test_a_law_of_temperature_that_is_none_of_the_catalogues_is_not_given_a_name(model: str) -> None:
    """A Gyrostar's bias is a tanh of temperature; one rising leg makes self-heating and hysteresis look like that."""
    found = held(made("gyrostar"), model)
    assert (found.verdict.form, found.verdict.named, found.verdict.depends_on[0]) == (
        "unexplained", (), "temperature_c",
    )  # fmt: skip
    assert "Since the temperature only rises" in " ".join(sentences(found))


@pytest.mark.parametrize("seed", [2, 3, 9])
def test_what_a_base_leaves_a_hundredth_of_is_not_named(seed: int) -> None:
    assert held(made("gyrostar", seed), "weiss1995").verdict.named == ()


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["saturation", "vibration_rectification"])
def test_the_remainder_of_a_large_effect_gets_no_second_name(effect: str) -> None:
    found = held(made("ojeda2000", 1, effect))
    assert found.verdict.groups == ((effect,),)


@pytest.mark.slow
def test_what_remains_is_said_with_its_channel() -> None:
    found = held(made("ojeda2000", 1, "saturation"))
    left = found.verdict.remainder
    assert left is not None
    assert 0 < left["share"] < 0.02
    assert left["depends_on"][0] == "table_rate_dps"
    assert any(line.startswith("saturation explains 99") for line in sentences(found))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "channel"), [("supply_scale", "supply_v"), ("humidity_scale", "humidity_pct"), ("time_step_scale", "t_s")]
)
def test_what_another_channel_does_to_the_scale_factor_depends_on_that_channel(kind: str, channel: str) -> None:
    verdict = held(KINDS[kind].added(made("ojeda2000"), 1, 0.05)).verdict
    assert (verdict.form, verdict.named) == ("unexplained", ())
    assert channel in {verdict.depends_on[0], *verdict.confounded}


@pytest.mark.slow
def test_an_effect_that_a_technology_cannot_have_is_not_named() -> None:
    """The sine of an open-loop interferometer is alike a cubic, and no MEMS gyro has one."""
    found = held(three_axes(1, scale_factor_odd=3e-9), "yang2018")
    assert found.comparison is not None
    sine = next(c for c in found.comparison.candidates if c.id == "sine_response")
    assert not sine.physical
    assert "sine_response" not in found.verdict.named
    assert "scale_factor_odd" in found.verdict.named


def test_a_sine_response_is_named_for_a_fibre_gyro() -> None:
    assert "sine_response" in held(single_axis(5, sine_response=0.25)).verdict.named


@pytest.mark.slow
def test_a_model_that_leaves_less_than_the_noise_is_adequate_whatever_is_like_the_rest() -> None:
    found = held(read_recording(EXAMPLES / "osu-fog"), full=True)
    assert (found.verdict.form, found.verdict.named) == ("adequate", ())
    assert found.verdict.further
    assert sum(line.startswith("Suspected and not named: ") for line in sentences(found)) == 1
    assert all(suspect.share_removed < 1 for suspect in found.suspects)


@pytest.mark.slow
def test_the_search_ends_where_the_data_say_nothing_more() -> None:
    """The real fibre gyro whose cause was added: what is left is weak, takes off hardly anything, and may be noise."""
    recording = read_recording(EXAMPLES / "osu-fog")
    data = fit_data_of(recording)
    before, _ = preset_for("bias_scale", []).build(data)
    found = criticise(recording, before)
    assert found.verdict.groups[0][0] == "sine_response"
    fit = next(suspect.after for suspect in found.suspects if suspect.candidate.id == "sine_response")
    assert fit is not None
    after = fit.fitted.model
    ended = criticise(recording, after)
    assert (ended.verdict.form, ended.verdict.named, ended.advice) == ("adequate", (), ())
    chance = ended.lack_of_fit[1]
    assert chance is not None
    assert chance > 0.05
    assert not {suspect.candidate.id for suspect in ended.suspects} & set(after.effect_ids)
    assert not {name for suspect in ended.suspects for name in suspect.group} & set(after.effect_ids)
    further = {name for group in ended.verdict.further for name in group}
    weak = [suspect for suspect in ended.suspects if suspect.candidate.id in further]
    assert weak
    assert all(suspect.share_removed < 0.1 for suspect in weak)
    why = answer_of("OSU", 2, [1], ended, []).why_not_named
    assert why in sentences(ended)
    without_fit = {True: ", but the model with it cannot be fitted", False: ""}
    for each in weak:
        assert f"{each.candidate.id} ({odds_text(each.candidate.log_bf)}{without_fit[bool(each.refused)]})" in why
    assert f"noise alone leaves a residual as large as this one in {probability_text(chance)} of cases" in why
    assert "takes off less than 10 % of the error above the noise floor" in why


@pytest.mark.slow
def test_one_name_that_explains_only_a_part_stays_ambiguous() -> None:
    """An effect that takes off little of the excess is the only one of its group, and still not certain."""
    found = held(read_recording(EXAMPLES / "osu-fog"), "bias_scale", full=True)
    assert found.base is not None
    alone = replace(found, verdict=Verdict("ambiguous", (("sine_response",),)))
    verdict = _without_weak_names(alone, found.suspects, found.base.fitted.model)
    assert (verdict.form, verdict.groups) == ("ambiguous", (("sine_response",),))


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["dead_band=z10", "scale_factor_asymmetry=z10"])
def test_a_small_cause_of_the_error_is_still_named(effect: str) -> None:
    request = SimulateRequest(recipe="ojeda2000-121", seed=4, hide=[effect], sample_rate_hz=4.0)
    found = held(make_recording(request).recording, full=True)
    assert effect.partition("=")[0] in found.verdict.named


@pytest.mark.slow
def test_axes_may_have_different_causes() -> None:
    recording = made("quick-triaxial")
    columns = dict(recording.columns)
    rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    about = {axis: np.where(columns["position"] == axis, rate, 0.0) for axis in "xyz"}
    columns["gyro_x"] = columns["gyro_x"] + 1e-8 * about["x"] ** 3
    columns["gyro_y"] = columns["gyro_y"] + 2e-6 * about["y"] ** 2
    columns["gyro_z"] = columns["gyro_z"] + 0.3 * (np.asarray(columns["supply_v"]) - 5.0)
    found = held(replace(recording, columns=columns), "yang2018")
    axes = {name: where for group in found.verdict.groups for name in group for where in [
        found.verdict.axes[group[0]]
    ]}  # fmt: skip
    assert axes["scale_factor_odd"] == ("x",)
    assert axes["scale_factor_even"] == ("y",)
    assert axes["supply_sensitivity"] == ("z",)
    assert " on x" in sentences(found)[0]


def test_a_term_that_predicts_left_out_temperatures_worse_rises() -> None:
    """A polynomial through steps from level to level follows what it saw, and nothing that it did not."""
    recording = single_axis(1)
    warm = np.asarray(recording.columns["chamber_setpoint_c"])
    level = np.searchsorted(np.unique(warm), warm)
    output = recording.columns["gyro_z"] + 0.05 * np.random.default_rng(3).normal(size=level.max() + 1)[level]
    stepped = replace(recording, columns={**recording.columns, "gyro_z": output})
    data = fit_data_of(stepped)
    model, _ = changed(preset_for("ojeda2000", []).build(data)[0]).build(data)
    comparison = compare_models(reduce_recording(stepped), model)
    assert held_out_rises(comparison, (Term("bias_temperature", 5),), CATALOGUE)
    assert not held_out_rises(comparison, (Term("scale_factor_asymmetry"),), CATALOGUE)


def test_a_curve_over_three_temperatures_does_not_hide_a_law_of_the_rate() -> None:
    """Two temperatures do not determine the parabola with which the third is predicted, with the law or without it."""
    recording = single_axis(3)
    warm = np.asarray(recording.columns["chamber_setpoint_c"])
    is_kept = np.isin(warm, np.unique(warm)[[0, 5, -1]])
    columns = {name: np.asarray(values)[is_kept] for name, values in recording.columns.items()}
    columns["gyro_z"] = columns["gyro_z"] + 3e-8 * columns["table_rate_dps"] ** 3
    found = held(replace(recording, columns=columns), "bias_scale")
    assert found.verdict.form == "ambiguous"
    assert set(found.verdict.groups[0]) == {"scale_factor_odd", "sine_response"}


def test_the_experiment_in_words_is_the_first_of_the_list() -> None:
    found = held(made("ojeda2000", 1))
    reported = Criticism(
        Verdict("ambiguous", (("scale_factor_odd", "sine_response"),)),
        found.data,
        found.fit_data,
        None,
        None,
        found.comparison,
    )
    asked = {
        "do": "the rates in random order",
        "power": 0.6,
        "names_wrong": 0.01,
        "information_bit": 0.2,
        "open_bit": 0.8,
    }
    said = sentences(reported, [asked, {"do": "another"}])
    assert "To distinguish them: the rates in random order." in said
    assert not any("another" in line for line in said)
    unlikely = asked | {"power": 0.1}
    assert not any("higher rates" in line for line in said)
    said = sentences(reported, [unlikely, unlikely | {"do": "another"}])
    largest_dps = float(np.max(np.abs(found.fit_data.true_rate_dps("z"))))
    assert any(line.startswith(f"Up to {largest_dps:.4g} deg/s these laws of the rate are nearly") for line in said)
    assert not any(line.startswith("To distinguish") for line in said)
    only = "The best experiment for its time names one cause alone with a probability of only 10 %"
    assert f"{only}: the rates in random order." in said
    said = sentences(reported, [unlikely, asked | {"do": "the rates for a week"}])
    assert f"{only}: the rates in random order. 60 % needs more time: the rates for a week." in said
    said = sentences(reported, [asked | {"power": 0.05}, {"do": "another"}])  # not expected to decide
    assert not any(line.startswith("To distinguish") for line in said)
    assert (
        "No experiment that labctl can plan from these data is expected to name one cause alone; this one tells "
        "most about how probable each effect is, 25 % of the missing information: the rates in random order."
    ) in said


@pytest.mark.slow
def test_what_is_not_physical_is_suspected_last_with_probability_0() -> None:
    """A MEMS unit has no open-loop interferometer: its sine is alike a cubic, and comes after what a MEMS can have."""
    recording = three_axes(1, scale_factor_odd=3e-9)
    found = held(recording, "yang2018", full=True)
    assert found.verdict.named == ("scale_factor_odd",)
    assert found.suspects[0].candidate.id == "scale_factor_odd"
    last = [suspect for suspect in found.suspects if not suspect.candidate.physical]
    assert "sine_response" in {suspect.candidate.id for suspect in last}
    assert list(found.suspects[-len(last) :]) == last
    assert {suspect.probability for suspect in last} == {0.0}
    assert sum(suspect.probability for suspect in found.suspects) == pytest.approx(1.0, abs=1e-6)
