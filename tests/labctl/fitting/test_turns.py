"""Calibrations from turns by a known angle: against published matrices, another package and simulated truths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from imucal import FerrarisCalibration, ferraris_regions_from_df

from labctl.errors import NotEnoughData
from labctl.fitting import fit
from labctl.fitting.criticism.candidates import untestable_channels
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.estimation.suggestion import suggested_model
from labctl.recording import Recording, to_points
from labctl.recording.files import read_recording
from studies.hand_turns import AXES, Unit, deviations, measured
from tests.helpers.paths import ROOT

EXAMPLE = ROOT / "labctl" / "examples" / "imucal-turns"
#: Published in imucal's repository at commit 8716e4c, tests/snapshots/example_cal.json: K_g @ R_g, words per deg/s,
#: rows are outputs, columns are axes of turning, by -360 deg; and b_g, words.
PUBLISHED = np.diag([16.67769558952488, 16.187895200550262, 16.253362639451936]) @ np.array([
    [-0.9999143756542296, -0.0006142300632876558, 0.013071498821540703],
    [0.0055057030733027396, -0.9992594967426224, -0.03808077472097593],
    [-0.01314650914177706, 0.0365074524847183, -0.9992469040284595],
])  # fmt: skip
PUBLISHED_BIAS = (1.960686204431737, -4.472837741243746, -3.6511794138670477)
WORDS = 16.4  #: per deg/s, nominal


@pytest.fixture(scope="module")
def published() -> Recording:
    return read_recording(EXAMPLE)


@pytest.fixture(scope="module")
def turned() -> Recording:
    rng = np.random.default_rng(3)
    return measured(rng, Unit.drawn(rng), 1.0, 2, 360.0)


def matrix_of(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Gains in words per deg/s and their standard uncertainties, rows outputs, columns axes of turning."""
    answer: Any = fit(recording, "turns").to_json()
    value, u = np.eye(3), np.zeros((3, 3))
    for row, axis in enumerate(AXES):
        for column, about in enumerate(AXES):
            name = "scale_factor" if axis == about else f"misalignment_{about}"
            found = answer["axes"][axis]["coefficients"][name]
            value[row, column] += found["value"]
            u[row, column] = found["u"]
    return value * WORDS, u * WORDS


def test_published_turns_give_the_published_matrix_within_its_uncertainty(published: Recording) -> None:
    value, u = matrix_of(published)
    assert np.abs(value + PUBLISHED).max() < 0.001  # the sense of the turns is the other one
    assert np.all(np.abs(value + PUBLISHED) < u)


def test_published_bias_is_found(published: Recording) -> None:
    answer: Any = fit(published, "turns").to_json()
    for axis, words in zip(AXES, PUBLISHED_BIAS, strict=True):
        bias = answer["axes"][axis]["coefficients"]["bias"]
        assert abs(bias["value"] - words / WORDS) < bias["u"]


def imucal_matrix(recording: Recording, rate_hz: float) -> np.ndarray:
    """Gains by the package imucal from six rests and three turns, (3, 3); gravity as the positions say."""
    position, turn = (np.asarray(recording.columns[name]) for name in ("position", "turn_deg"))
    rests = {sign + axis: axis + ("_a" if sign else "_p") for axis in AXES for sign in ("", "-")}
    frame = pd.DataFrame({f"gyr_{a}": np.asarray(recording.columns[f"gyro_{a}"], dtype=np.float64) for a in AXES})
    for axis in AXES:
        frame[f"acc_{axis}"] = 9.81 * ((position == axis) * 1.0 - (position == f"-{axis}"))
    sections = [f"{p[-1]}_rot" if deg else rests[str(p)] for p, deg in zip(position, turn, strict=True)]
    frame.index = pd.Index(sections)
    found = FerrarisCalibration(expected_angle=360).compute(
        ferraris_regions_from_df(frame), sampling_rate_hz=rate_hz, from_acc_unit="m/s^2", from_gyr_unit="a.u."
    )
    return np.asarray(found.K_g @ found.R_g)


def test_imucal_finds_the_same_of_the_published_turns(published: Recording) -> None:
    value, u = matrix_of(published)
    theirs = imucal_matrix(published, 204.8)
    assert np.abs(theirs + PUBLISHED).max() < 0.001
    assert np.all(np.abs(value - theirs) < u)


def test_imucal_finds_the_same_of_simulated_turns() -> None:
    """One turn about each axis, as the package takes them; it knows no uncertainty."""
    rng = np.random.default_rng(11)
    both = measured(rng, Unit.drawn(rng), 0.1, 1, 360.0)
    once = np.isin(np.asarray(both.columns["dataset"]), [1, 2, 3, 4, 5, 6, 7, 9, 11])
    taken = Recording(both.info, {name: values[once] for name, values in both.columns.items()})
    value, u = matrix_of(taken)
    assert np.all(np.abs(value / WORDS - imucal_matrix(taken, 100.0)) < u / WORDS)


@pytest.mark.slow
def test_coverage_of_two_standard_uncertainties() -> None:
    """Of 40 sets here; `python -m studies hand_turns` has 200 of each case."""
    found = [deviations(900 + k, 1.0, 1, 360.0) for k in range(40)]
    for kind in found[0]:
        pooled = np.array([value for each in found for value in each[kind]])
        assert 0.91 <= np.mean(np.abs(pooled) <= 2) <= 1.0, kind
    scale = np.array([value for each in found for value in each["scale"]])
    assert 0.8 < np.sqrt(np.mean(scale**2)) < 1.2


def test_uncertainty_of_the_turn_is_that_of_the_scale_factor(turned: Recording) -> None:
    """Four turns about an axis, of 1 deg in 360 each: u of the scale factor is 1/360/2; more where they disagree."""
    answer: Any = fit(turned, "turns").to_json()
    u = [answer["axes"][axis]["coefficients"]["scale_factor"]["u"] for axis in AXES]
    assert min(u) == pytest.approx(1 / 720, rel=0.1)
    assert max(u) < 1.5 / 720


@pytest.mark.slow
def test_a_common_error_of_all_turns_is_not_averaged_out(turned: Recording) -> None:
    """A fixture that turns too far by a share of 2 %: no gain is more certain than that."""
    common = replace(turned, info=turned.info.model_copy(update={"turn_common_u": 0.02}))
    alone, beside = matrix_of(turned), matrix_of(common)
    np.testing.assert_allclose(beside[0], alone[0])
    np.testing.assert_allclose(beside[1], np.hypot(alone[1], 0.02 * np.abs(alone[0])), rtol=0.02)
    without: Any = fit(turned, "turns").to_json()
    bias: Any = fit(common, "turns").to_json()
    assert bias["axes"]["x"]["coefficients"]["bias"]["u"] == pytest.approx(
        without["axes"]["x"]["coefficients"]["bias"]["u"], rel=1e-6
    )


def test_more_turns_at_once_make_the_scale_factor_more_certain() -> None:
    rng = np.random.default_rng(5)
    unit = Unit.drawn(rng)
    u = [matrix_of(measured(rng, unit, 1.0, 1, deg))[1][0, 0] for deg in (360.0, 1080.0)]
    assert u[0] / u[1] == pytest.approx(3.0, rel=0.25)


def test_means_alone_give_the_same(turned: Recording) -> None:
    """The spread of a turn's readings is its motion; the noise of a reading is that of the rests."""
    points = to_points(turned)
    columns = {name: v for name, v in points.columns.items() if not name.endswith(("white_std", "time_std"))}
    means: Any = fit(replace(points, columns=columns), "turns").to_json()
    readings: Any = fit(turned, "turns").to_json()
    for axis in AXES:
        ours, theirs = (a["axes"][axis]["coefficients"] for a in (means, readings))
        for name in ours:
            assert ours[name]["value"] == pytest.approx(theirs[name]["value"], abs=0.2 * theirs[name]["u"])
            assert ours[name]["u"] == pytest.approx(theirs[name]["u"], rel=0.2)


@pytest.mark.parametrize("each_way", [1, 2, 3])
def test_noise_floor_is_what_is_left(each_way: int) -> None:
    """With few data sets too: what is linear in the rate is no drift."""
    rng = np.random.default_rng(8)
    error = fit(measured(rng, Unit.drawn(rng), 1.0, each_way, 360.0), "turns").error
    assert error.noise_floor_dps is not None
    assert error.rms_dps is not None
    assert 0.8 < error.noise_floor_dps / error.rms_dps < 2.0


def test_each_turn_is_held_out(turned: Recording) -> None:
    assert len(fit_data_of(turned).held_out_pairs) == 12
    error = fit(turned, "turns").error
    assert error.heldout_rms_dps is not None
    assert error.rms_dps is not None
    assert error.rms_dps < error.heldout_rms_dps < 3 * error.rms_dps


def test_one_turn_about_each_axis_leaves_none_to_hold_out(published: Recording) -> None:
    assert fit(published, "turns").error.heldout_rms_dps is None


def test_gravity_is_fitted_where_both_ways_up_rested(turned: Recording) -> None:
    assert "cross_g_sensitivity" in fit(turned, "turns").fitted.model.effect_ids
    up = np.char.startswith(np.asarray(turned.columns["position"]).astype(np.str_), "-")
    one_way = Recording(turned.info, {name: values[~up] for name, values in turned.columns.items()})
    assert fit(one_way, "turns").fitted.model.effect_ids == ["bias", "scale_factor", "misalignment"]


@pytest.mark.parametrize("effect", ["scale_factor_odd", "scale_factor_asymmetry", "dead_band", "saturation"])
def test_what_needs_the_rate_at_each_instant_is_refused(turned: Recording, effect: str) -> None:
    with pytest.raises(
        NotEnoughData, match=f"{effect} needs the rate at each instant, but only the mean rate of a turn"
    ):
        fit(turned, None, ["bias", "scale_factor", effect])


def test_what_needs_the_rate_at_each_instant_is_never_named(turned: Recording) -> None:
    absent = untestable_channels(reduce_recording(turned))
    assert absent["scale_factor_odd"] == absent["scale_factor_asymmetry"] == ["table_rate_dps"]
    assert not {"scale_factor", "misalignment", "g_sensitivity", "bias"} & set(absent)


def test_the_preset_for_turns_is_proposed(published: Recording) -> None:
    assert suggested_model(to_points(published)) == "turns"


def test_validity_is_how_fast_the_turns_went(turned: Recording) -> None:
    low, high = fit(turned, "turns").to_json()["validity"]["rate_dps"]
    assert low is not None
    assert high is not None
    fastest = max(float(np.abs(np.asarray(turned.columns[f"gyro_{a}"])).max()) for a in AXES)
    assert max(-low, high) == pytest.approx(fastest, rel=0.02)
