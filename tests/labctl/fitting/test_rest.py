"""A temperature loop at rest: what is an error of the bias is fitted and distinguished, and no scale factor is
claimed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting import fit
from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.criticism import best_shapes
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Formula
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording
from tests.helpers.recordings import points

RAMP_K_MIN = 2.0
WHITE_DPS = 2e-4
BASE = ["bias", "bias_temperature"]


def loop(seed: int, *, lag_dps_k: float = 0.0, tau_s: float = 600.0, play_dps: float = 0.0) -> Recording:
    """Return minutes at rest, 0 to 40 deg C and back twice, with a follower of the thermometer and a play of 6 K."""
    rng = np.random.default_rng(seed)
    t_s = np.arange(0.0, 80 * 60.0, 10.0)
    warm = 40.0 * np.abs((t_s * RAMP_K_MIN / 60.0 / 40.0 + 1) % 2 - 1)
    follower, play = np.empty_like(warm), np.empty_like(warm)
    follower[0] = play[0] = warm[0]
    for i in range(1, len(warm)):
        follower[i] = follower[i - 1] + (warm[i] - follower[i - 1]) * 10.0 / tau_s
        play[i] = min(max(play[i - 1], warm[i] - 3.0), warm[i] + 3.0)
    error = 0.05 + 2e-3 * warm - 1e-5 * warm**2 + lag_dps_k * (follower - warm) + play_dps * (warm - play) / 3.0
    minutes = (np.mean(v.reshape(-1, 6), axis=1) for v in (t_s, warm, error))
    t_min, warm_min, error_min = minutes
    n = len(t_min)
    made = points(np.zeros(n), warm_min, error_min + rng.normal(0, WHITE_DPS, n))
    columns = {
        **made.columns, "t_s": t_min, "power_s": t_min + 600.0, "supply_v": 12 + 0.01 * rng.normal(size=n),
        "gyro_z_std": np.full(n, WHITE_DPS * 10), "n": np.full(n, 100),
    }  # fmt: skip
    return Recording(made.info, columns, {"t_s": t_s, "temperature_c": warm})


def improved(recording: Recording, *effects: str) -> tuple[FitResult, FitResult]:
    """Return the fit of bias and its temperature terms, and the one with effects in their best shapes added."""
    data = fit_data_of(recording)
    model, _ = preset_for(None, BASE).build(data)
    before = fit_preset(data, changed(model))
    after = before
    for effect in effects:
        model = after.fitted.model
        shape = best_shapes(recording, model, {effect: CATALOGUE[effect]}, points=recording)[effect]
        after = fit_preset(data, changed(model, (replace(shape, steady=True),)))
    return before, after


@pytest.mark.parametrize("tau_s", [300.0, 500.0, 900.0])
def test_adding_the_lag_at_rest_brings_the_held_out_error_to_the_floor(tau_s: float) -> None:
    recording = loop(1, lag_dps_k=2e-3, tau_s=tau_s)
    before, after = improved(recording, "thermal_lag")
    assert before.error.heldout_rms_dps is not None
    assert after.error.heldout_rms_dps is not None
    assert before.error.heldout_rms_dps > 20 * WHITE_DPS
    assert after.error.heldout_rms_dps < 1.5 * WHITE_DPS
    assert after.fitted.model.terms[-1].parameters["tau_s"] == pytest.approx(tau_s, rel=0.1)


def test_adding_lag_and_hysteresis_at_rest_brings_the_held_out_error_near_the_floor() -> None:
    before, after = improved(loop(2, lag_dps_k=2e-3, play_dps=5e-3), "thermal_lag", "thermal_hysteresis", "thermal_lag")
    assert before.error.heldout_rms_dps is not None
    assert after.error.heldout_rms_dps is not None
    assert before.error.heldout_rms_dps > 20 * WHITE_DPS
    assert after.error.heldout_rms_dps < 0.15 * before.error.heldout_rms_dps


def test_the_suspects_of_a_loop_at_rest_have_error_figures_and_none_is_of_the_scale_factor() -> None:
    recording = loop(3, lag_dps_k=2e-3)
    model, _ = preset_for(None, BASE).build(fit_data_of(recording))
    found = criticise(recording, model)
    assert found.verdict.named == ("thermal_lag",)
    first = found.suspects[0]
    assert first.after is not None
    assert first.after.error.heldout_rms_dps is not None
    assert first.after.error.heldout_rms_dps < 1.5 * WHITE_DPS
    assert all(CATALOGUE[s.candidate.id].shows_at_rest for s in found.suspects)
    assert {"scale_factor", "saturation"} <= {line["effect"] for line in found.not_testable}


@pytest.mark.parametrize(
    "effect", ["thermal_lag", "thermal_hysteresis", "temperature_rate", "warm_up", "bias_drift", "supply_sensitivity"]
)
def test_effects_of_the_bias_are_fitted_at_rest(effect: str) -> None:
    result = fit(loop(4), effects=[*BASE, effect])
    assert result.error.heldout_rms_dps is not None


def test_at_rest_only_the_part_of_an_effect_that_shows_at_rest_is_claimed() -> None:
    result = fit(
        replace(loop(5), info=loop(5).info.model_copy(update={"latitude_deg": 47.0})), effects=[*BASE, "self_heating"]
    )
    assert result.fitted.axes["z"].names == ("bias", "bias_t1", "bias_t2", "self_heating")


@pytest.mark.parametrize("effect", ["scale_factor", "saturation", "rate_hysteresis", "start_transient", "dead_band"])
def test_effects_of_the_rate_are_refused_at_rest_also_beside_the_earths_rate(effect: str) -> None:
    recording = loop(6)
    n = len(recording.columns["t_s"])
    tumbled = {**recording.columns, "position": np.where(np.arange(n) % 2, "z", "-z")}
    info = recording.info.model_copy(update={"latitude_deg": 47.0})
    with pytest.raises(NotEnoughData, match=f"{effect} needs at least 2 different rates; the recording has 1"):
        fit(Recording(info, tumbled, recording.environment), effects=["bias", effect])


def test_a_formula_needs_rates_only_where_it_names_one() -> None:
    assert Formula("humid", "supply_v * temperature_c").shows_at_rest
    assert not Formula("load", "supply_v * rate_dps").shows_at_rest
