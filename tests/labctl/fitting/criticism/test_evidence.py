"""Evidence over a grid of noises: by modes of the drift it is the same as noise by noise; outliers by order."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.criticism.evidence.design import Design
from labctl.fitting.criticism.evidence.drawn_shifts import DrawnShifts
from labctl.fitting.criticism.evidence.elimination import MeansByNoise, ScaledBase, WhitenedBase, gains_by_noise
from labctl.fitting.criticism.evidence.gains import gains_of
from labctl.fitting.criticism.evidence.noise_grid import DriftModes, correlation, noise_grid
from labctl.fitting.criticism.reduction.outliers import FEW, inlier_mask


def test_gains_at_every_noise_are_those_at_each_by_itself() -> None:
    rng = np.random.default_rng(3)
    m, present = 60, np.ones((2, 60), dtype=bool)
    design = Design(
        rng.normal(size=(2, m, 3)), np.array([0.0, 0.0, 4.0]), [], present,
        np.sort(rng.uniform(0, 5000, m)), np.repeat([1, 2], m // 2),
    )  # fmt: skip
    white, scale = rng.uniform(0.5, 2.0, m) * 1e-6, np.full((2, m), 1e-3)
    columns = rng.normal(size=(2, m, 6))
    slices = [slice(0, 1), slice(1, 3), slice(3, 5)]
    noises = noise_grid("mems", 0.003, 1e-3)
    others = ScaledBase(design, scale).products(columns)
    means = MeansByNoise.of(design, columns[0], slices, white, noises)
    found = gains_by_noise(means, others, g=60.0, drawn=[2])
    for i, noise in enumerate(noises):
        left = WhitenedBase(design, white, noise).eliminate_from(columns[0], others)
        expected, number = gains_of(left, slices)
        assert found.log_p[i] == pytest.approx(left.log_p, rel=1e-10)
        np.testing.assert_allclose(found.gain[i], expected, rtol=1e-9)
        assert found.dimensions[i].tolist() == number.tolist()
        unit_information = 0.5 * expected * 60 / 61 - 0.5 * number * np.log(61)
        np.testing.assert_allclose(found.log_bf[i, :2], unit_information[:2], rtol=1e-9)
        of_draws = DrawnShifts.of(left.gram[3:5, 3:5], 60.0).log_bf(left.data_products[3:5])
        assert found.log_bf[i, 2] == pytest.approx(float(of_draws), rel=1e-9)


@pytest.mark.parametrize("tau_s", [0.0, 120.0, 4000.0])
@pytest.mark.parametrize("nearest_s", [60.0, 1e-2, 0.0])
def test_modes_diagonalise_the_drift_over_the_noise(tau_s: float, nearest_s: float) -> None:
    """Whatever their decomposition: data sets at irregular times, as near as `nearest_s`, in two runs."""
    rng = np.random.default_rng(5)
    t_s = np.cumsum(np.append(nearest_s, rng.uniform(50, 200, 79)))
    t_s[40] = t_s[39] + nearest_s
    run, white = np.repeat([1, 2], 40), rng.uniform(0.5, 2.0, 80) * 1e-6
    modes = DriftModes.of(tau_s, white, t_s, run)
    for number, (rows, vectors) in zip((1, 2), modes.blocks, strict=True):
        assert np.array_equal(rows, np.flatnonzero(run == number))
        noise, drift = vectors.T @ np.diag(white[rows]) @ vectors, vectors.T @ correlation(t_s[rows], tau_s) @ vectors
        np.testing.assert_allclose(noise, np.eye(40), atol=1e-10)
        np.testing.assert_allclose(drift, np.diag(modes.variance[rows]), atol=1e-9 * drift.max())


def test_outliers_are_those_by_median_and_quantile_of_what_is_there() -> None:
    rng = np.random.default_rng(4)
    values, there = rng.normal(size=(40, 101)), np.ones((40, 101))
    there[::3, 70:] = 0.0
    values[:, 5] += rng.choice([0.0, 30.0], 40)
    masked = np.where(there > 0, values, np.nan)
    far = np.abs(masked - np.nanmedian(masked, axis=1, keepdims=True))
    limit = np.maximum(
        6 * 1.4826 * np.nanmedian(far, axis=1, keepdims=True), 3 * np.nanquantile(far, 1 - 2 * FEW, axis=1)[:, None]
    )
    np.testing.assert_array_equal(inlier_mask(values, there) == 0.0, far > limit)
    assert (inlier_mask(values, there) == 0.0).sum() > 5
