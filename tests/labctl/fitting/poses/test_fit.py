"""Calibration by hand: against known truth, with wrong moves, saturation, drift, jitter, and too little to go by."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting import FitResult, fit
from labctl.fitting.poses.between_variance import gls
from labctl.fitting.poses.equations import Equations
from labctl.fitting.poses.held_out import held_out_moves
from labctl.fitting.poses.rotation import Rotations
from labctl.recording import Recording
from studies.poses import score
from studies.poses_simulation import Session, Truth, simulate_session

KNOWN = Session(rests=22, latitude_deg=48.0)


def matrix(result: FitResult) -> tuple[np.ndarray, np.ndarray]:
    """Return E (3, 3) and its standard uncertainties."""
    value, u = np.empty((3, 3)), np.empty((3, 3))
    for i, axis in enumerate("xyz"):
        fitted = result.fitted.axes[axis]
        for j, other in enumerate("xyz"):
            place = fitted.names.index("scale_factor" if i == j else f"misalignment_{other}")
            value[i, j], u[i, j] = fitted.values[place, 0], fitted.u[place, 0]
    return value, u


def agrees(result: FitResult, truth: Truth) -> bool:
    value, u = matrix(result)
    return bool(np.all(np.abs(value - truth.gyro) < 4 * u))


@pytest.mark.slow
def test_coefficients_cover_the_truth_and_held_out_moves_their_error() -> None:
    scores: dict[str, list[float]] = defaultdict(list)
    within, figures = [], []
    for seed in range(12):
        recording, truth = simulate_session(seed, KNOWN)
        result = fit(recording, "poses")
        score(result, truth, scores, latitude_known=True)
        assert result.poses is not None
        within.append(result.poses["held_out"]["within_2u"])
        figures.append((result.error.rms_dps, result.error.heldout_rms_dps, result.error.noise_floor_dps))
    for kind in ("scale factor", "misalignment", "bias"):
        z = np.array(scores[kind])
        assert np.mean(np.abs(z) <= 2) > 0.8, kind  # of 36 at least: four standard deviations below 95 %
        assert 0.65 < np.sqrt(np.mean(z**2)) < 1.3, kind
    assert np.mean(within) == pytest.approx(0.955, abs=0.04)
    after, held_out, floor = np.mean(figures, axis=0)
    assert after < held_out < 2 * floor


def test_the_uncertainty_is_no_larger_than_a_hand_allows() -> None:
    recording, truth = simulate_session(1, KNOWN)
    value, u = matrix(fit(recording, "poses"))
    assert u.max() < 5e-4
    assert np.abs(truth.gyro).max() > 20 * u.max()
    assert value == pytest.approx(truth.gyro, abs=2e-3)


def test_moves_in_which_readings_were_lost_unseen_are_left_out_and_named() -> None:
    recording, truth = simulate_session(5, replace(KNOWN, wrong_moves=(4, 11)))
    result = fit(recording, "poses")
    assert result.poses is not None
    left = result.poses["moves"]["left_out"]
    assert len(left) == 2
    assert all("does not agree with the other moves: gravity after the move is" in each["why"] for each in left)
    assert agrees(result, truth)
    alone, _ = simulate_session(5, KNOWN)
    clean, _ = matrix(fit(alone, "poses"))
    assert matrix(result)[0] == pytest.approx(clean, abs=1e-3)


def test_saturated_turns_are_left_out_and_named() -> None:
    recording, truth = simulate_session(6, replace(KNOWN, full_scale_dps=110.0))
    result = fit(recording, "poses")
    assert result.poses is not None
    left = result.poses["moves"]["left_out"]
    assert left
    assert all("is saturated at" in each["why"] for each in left)
    assert agrees(result, truth)
    free, _ = simulate_session(6, KNOWN)
    assert fit(free, "poses").poses["moves"]["left_out"] == []  # type: ignore[index]


def test_a_move_with_a_gap_is_left_out_and_named() -> None:
    recording, truth = simulate_session(7, KNOWN)
    fastest = int(np.argmax(np.abs(np.asarray(recording.columns["gyro_x"]))))
    keep = np.ones(len(recording), dtype=bool)
    keep[fastest - 5 : fastest + 5] = False
    result = fit(Recording(recording.info, {n: v[keep] for n, v in recording.columns.items()}), "poses")
    assert result.poses is not None
    (left,) = result.poses["moves"]["left_out"]
    assert left["why"].startswith("a gap of 0.11 s in the readings")
    assert agrees(result, truth)


@pytest.mark.parametrize(
    "hard",
    [{"warm_up_dps": 1.0}, {"jitter_s": 0.001}, {"quantum_dps": 0.0625}, {"rate_hz": 40.0}],
    ids=lambda hard: next(iter(hard)),
)
def test_warm_up_jitter_coarse_steps_and_slow_sampling_stay_within_the_uncertainty(hard: dict[str, float]) -> None:
    recording, truth = simulate_session(8, replace(KNOWN, **hard))
    assert agrees(fit(recording, "poses"), truth)


def test_jitter_and_slow_sampling_make_it_less_certain() -> None:
    quiet, _ = simulate_session(8, KNOWN)
    shaky, _ = simulate_session(8, replace(KNOWN, jitter_s=0.002))
    slow, _ = simulate_session(8, replace(KNOWN, rate_hz=16.0))
    u = [matrix(fit(recording, "poses"))[1].mean() for recording in (quiet, shaky, slow)]
    assert u[1] > 1.2 * u[0]
    assert u[2] > 1.2 * u[0]


def test_sensitivity_to_gravity_is_told_from_the_bias() -> None:
    recording, truth = simulate_session(9, KNOWN)
    result = fit(recording, "poses")
    for i, axis in enumerate("xyz"):
        fitted = result.fitted.axes[axis]
        for j, other in enumerate("xyz"):
            place = fitted.names.index("g_own" if i == j else f"g_{other}")
            assert abs(fitted.values[place, 0] - truth.per_g[i, j]) < 4 * fitted.u[place, 0]
    exported, left_out = result.fitted.exported()
    assert exported.model.effect_ids == ["bias", "scale_factor", "misalignment"]
    assert [each["effect"] for each in left_out] == ["g_sensitivity", "cross_g_sensitivity"]


def test_an_unknown_latitude_is_in_the_uncertainty_of_the_own_sensitivity() -> None:
    known, _ = simulate_session(9, KNOWN)
    unknown, _ = simulate_session(9, replace(KNOWN, latitude_deg=None))
    u = []
    for recording in (known, unknown):
        fitted = fit(recording, "poses").fitted.axes["x"]
        u.append(fitted.u[fitted.names.index("g_own"), 0])
    assert u[1] > u[0]
    assert u[1] > 15.041067 / 3600 / np.sqrt(3) * 0.99


@pytest.mark.parametrize(
    ("session", "said"),
    [
        (Session(rests=8), r"8 rests in 8 different poses; .* at least 12 for bias.*: lay the unit down"),
        (Session(rests=30, about_vertical=True), r"different poses; .* lay the unit down"),
    ],
)
def test_too_little_is_refused_with_what_to_do(session: Session, said: str) -> None:
    recording, _ = simulate_session(1, session)
    with pytest.raises(NotEnoughData, match=said) as refused:
        fit(recording, "poses")
    assert "\n" not in str(refused.value)


def test_another_model_another_motion_means_and_two_axes_are_refused() -> None:
    recording, _ = simulate_session(1, Session(rests=3))
    with pytest.raises(BadInput, match="with --model poses and without added effects"):
        fit(recording, "yang2018")
    with pytest.raises(BadInput, match="with --model poses and without added effects"):
        fit(recording, "poses", ["bias_temperature"])

    def changed(**head: object) -> Recording:
        return replace(recording, info=recording.info.model_copy(update=head))

    with pytest.raises(
        BadInput, match="needs a recording with motion = 'poses', but this recording has motion = 'rates'"
    ):
        fit(changed(motion="rates"), "poses")
    with pytest.raises(BadInput, match="every reading of the turns"):
        fit(changed(kind="points"), "poses")
    with pytest.raises(BadInput, match="no column gyro_z"):
        fit(changed(axes=("x", "y")), "poses")


def test_a_held_out_move_is_predicted_as_by_a_fit_that_has_not_seen_it() -> None:
    rng = np.random.default_rng(1)
    m = 14
    jacobian, noise = rng.normal(size=(2 * m, 9)), rng.normal(size=(2 * m, 2 * m))
    covariance = noise @ noise.T + np.eye(2 * m)
    residual = rng.normal(size=2 * m)
    zeros = np.zeros((m, 2, 3))
    equations = Equations(residual, jacobian, zeros, zeros, Rotations(*[zeros] * 5))
    used = np.ones(m, dtype=bool)
    used[3] = False
    found = held_out_moves(equations, covariance, used)
    for move in (0, 3, 9):
        others = np.repeat(used, 2)
        here = [2 * move, 2 * move + 1]
        others[here] = False
        values, _ = gls(jacobian[others], residual[others], covariance[np.ix_(others, others)])
        assert found.error[move] == pytest.approx(residual[here] - jacobian[here] @ values, abs=1e-9)
        known = covariance[np.ix_(others, others)]
        gain = np.stack([gls(jacobian[others], one, known)[0] for one in np.eye(others.sum())], axis=1)
        full = np.zeros((2, 2 * m))
        full[:, others] = -jacobian[here] @ gain
        full[[0, 1], here] += 1.0
        assert found.covariance[move] == pytest.approx(full @ covariance @ full.T, abs=1e-9)
