"""The sine response of an open-loop interferometer: one constant K per axis, with its uncertainty, and its inverse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from labctl.fitting import FittedModel, fit
from labctl.fitting.criticism import criticise
from labctl.fitting.data.channels import Channels
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import Term, parse_term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.correction import correction
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit
from labctl.fitting.models.presets import changed
from labctl.fitting.models.sine_form import sine_form_of
from labctl.fitting.numeric.open_loop_sine import sine_ratio, sine_ratio_slope
from labctl.recording import Recording, read_recording
from tests.helpers.paths import ROOT
from tests.helpers.recordings import points

EFFECTS = ["bias", "scale_factor", "sine_response"]
RATES = np.array([0.0, *(s * r for r in (20, 50, 100, 150, 200, 250, 300, 350, 400) for s in (1, -1))])


def open_loop(k: float, noise_dps: float = 0.0, seed: int = 1, rates: np.ndarray = RATES) -> Recording:
    """Return data sets of an interferometer with constant k in rad/(rad/s), or a straight law at k = 0."""
    rate = np.tile(rates, 11)
    warm = np.repeat(np.linspace(0, 50, 11), len(rates))
    optical = np.rad2deg(np.sin(k * np.deg2rad(rate)) / k) if k else rate
    rng = np.random.default_rng(seed)
    made = points(rate, warm, optical + 0.02 + 1e-3 * rate + noise_dps * rng.normal(size=len(rate)))
    if noise_dps == 0:
        return made
    spread = {"gyro_z_std": np.full(len(rate), 10 * noise_dps), "n": np.full(len(rate), 100)}
    return Recording(made.info, {**made.columns, **spread})


def k_of(result: FitResult, axis: str = "z") -> dict[str, Any]:
    found: dict[str, Any] = result.to_json()["axes"][axis]["coefficients"]["k"]
    return found


@pytest.mark.parametrize("k", [0.01, 0.05, 0.1, 0.2])
def test_the_constant_is_found_exactly(k: float) -> None:
    result = fit(open_loop(k), effects=EFFECTS)
    assert result.error.rms_dps == pytest.approx(0.0, abs=1e-8)
    assert k_of(result)["value"] == pytest.approx(k, rel=1e-6)
    assert k_of(result)["unit"] == "rad/(rad/s)"
    assert set(result.fitted.axes["z"].names) == {"bias", "scale_factor", "k_squared"}


@pytest.mark.slow
def test_its_uncertainty_covers_the_truth() -> None:
    score = []
    for seed in range(20):
        found = k_of(fit(open_loop(0.05, 2e-3, seed), effects=EFFECTS))
        assert found["identified"]
        score.append((found["value"] - 0.05) / found["u"])
    assert 0.7 < np.std(score) < 1.3
    assert abs(np.mean(score)) < 0.6


def test_where_the_data_do_not_show_it_that_is_said_with_a_bound() -> None:
    for seed in range(4):
        found = k_of(fit(open_loop(0.0, 2e-3, seed), effects=EFFECTS))
        assert not found["identified"]
        assert 0 < found["at_most"] < 0.01


def test_a_law_that_bends_the_other_way_is_no_sine() -> None:
    rate = np.tile(RATES, 3)
    result = fit(points(rate, np.repeat([10.0, 20.0, 30.0], len(RATES)), rate + 1e-8 * rate**3), effects=EFFECTS)
    assert result.error.rms_dps == pytest.approx(0.0, abs=0.02)
    found = k_of(result)
    assert not found["identified"]
    assert found["at_most"] == 0.0


@pytest.mark.slow
def test_nothing_is_missing_beside_it_and_the_suspect_is_the_same_constant() -> None:
    recording = open_loop(0.15, 2e-3)
    samples = Recording(recording.info.model_copy(update={"technology": "fog"}), recording.columns)
    complete = fit(samples, effects=EFFECTS).fitted.model
    assert criticise(samples, complete, full=False).verdict.form == "adequate"
    found = criticise(samples, complete.with_terms(complete.terms[:2]))
    suspect = next(s for s in found.suspects if s.candidate.id == "sine_response")
    assert suspect.coefficients["z"]["k"]["value"] == pytest.approx(0.15, rel=0.02)


def model(k_squared: float, scale: float = 1e-3) -> FittedModel:
    axis = AxisFit(
        ("bias", "scale_factor", "sine_response"), ("bias", "scale_factor", "k_squared"), ("deg/s", "1", "1"),
        np.array([[0.5], [scale], [k_squared]]), np.zeros((3, 3)),
    )  # fmt: skip
    return FittedModel(ErrorModel("open", tuple(map(Term, EFFECTS))), {"z": axis})


@pytest.mark.parametrize("k_squared", [0.0, 1e-9, 0.01, 0.04, -0.01])
def test_the_sine_response_is_inverted_exactly(k_squared: float) -> None:
    fitted = model(k_squared)
    rate = np.linspace(-400, 400, 1001)
    channels = Channels({"temperature_c": np.full(len(rate), 20.0)}, {"z": rate})
    output = rate + fitted.error_dps(channels, "z")
    assert sine_form_of(fitted, ("z",)) is not None
    found = correction(fitted, ("z",))(output[:, None], np.full(len(rate), 20.0), {})
    assert found[:, 0] == pytest.approx(rate, abs=1e-10)
    assert fitted.compensate({"z": output}, channels)["z"] == pytest.approx(rate, abs=1e-8)


def test_a_pure_sine_is_inverted_by_the_arcsine() -> None:
    fitted = model(0.04, scale=0.0)
    output = np.linspace(-200.0, 200.0, 101)
    found = correction(fitted, ("z",))(output[:, None], np.full(len(output), 20.0), {})
    assert found[:, 0] == pytest.approx(np.rad2deg(np.arcsin(0.2 * np.deg2rad(output - 0.5)) / 0.2), abs=1e-11)


def test_the_ratio_and_its_slope_pass_zero_smoothly() -> None:
    x = np.linspace(-5e-3, 5e-3, 2001)
    assert np.abs(np.diff(sine_ratio(x), 2)).max() < 1e-12
    numeric = (sine_ratio(x + 1e-4) - sine_ratio(x - 1e-4)) / 2e-4
    assert sine_ratio_slope(x) == pytest.approx(numeric, abs=1e-9)


def test_a_calibration_of_version_0_1_keeps_its_law() -> None:
    record = model(0.01).to_dict()
    record["terms"][2]["parameters"] = {"k": 0.1}
    record["axes"]["z"] |= {"names": ["bias", "scale_factor", "sine_response"], "values": [[0.5], [1e-3], [2.65]]}
    fitted = FittedModel.from_dict(record)
    rate = np.array([300.0])
    channels = Channels({"temperature_c": np.array([20.0])}, {"z": rate})
    expected = 0.5 + 0.3 + 2.65 * (np.rad2deg(np.sin(0.1 * np.deg2rad(300.0)) / 0.1) - 300.0)
    assert fitted.error_dps(channels, "z") == pytest.approx(expected)
    assert FittedModel.from_dict(fitted.to_dict()).error_dps(channels, "z") == pytest.approx(expected)
    assert sine_form_of(fitted, ("z",)) is None


@pytest.mark.slow
def test_every_axis_has_its_own_constant(triaxial: Callable[[int], Any]) -> None:
    recording = triaxial(3).campaign(3)
    columns = dict(recording.columns)
    for axis, k in zip("xyz", (0.05, 0.1, 0.15), strict=True):
        own = np.where(columns["position"] == axis, columns["table_rate_dps"], 0.0)
        columns[f"gyro_{axis}"] = columns[f"gyro_{axis}"] + np.rad2deg(np.sin(k * np.deg2rad(own)) / k) - own
    result = fit(replace(recording, columns=columns), "yang2018", ["sine_response"])
    for axis, k in zip("xyz", (0.05, 0.1, 0.15), strict=True):
        found = k_of(result, axis)
        assert abs(found["value"][0] - k) < 4 * found["u"][0]


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["scale_factor_odd", "scale_factor_asymmetry"])
def test_a_law_beside_which_another_effect_is_hardly_seen_leaves_no_more_than_alone(effect: str) -> None:
    """Its tangent leads far away, and an average of coefficients over the noise does not lie on the law."""
    gyro = read_recording(ROOT / "labctl" / "examples" / "osu-fog")
    alone = fit(gyro, effects=["bias_temperature", "scale_factor_temperature", *EFFECTS])
    beside = fit_preset(fit_data_of(gyro), changed(alone.fitted.model, (parse_term(effect),)))
    assert beside.error.rms_dps is not None
    assert alone.error.rms_dps is not None
    assert 0.045 < beside.error.rms_dps < alone.error.rms_dps == pytest.approx(0.0481, abs=5e-5)
