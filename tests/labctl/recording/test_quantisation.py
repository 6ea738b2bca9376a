"""What coarse steps leave in a mean: the formula against simulated converters, and the columns that carry it."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording import to_points
from labctl.recording.output_steps import with_quantisation
from labctl.recording.quantisation import codes_of, figures_of, quantisation_std, quantisation_variance
from labctl.recording.spread import white_std, white_stds
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.spoilt import quantised, spoilt


@pytest.mark.parametrize(("noise", "wave"), [(0.0, 0.0), (0.1, 0.0), (0.25, 0.0), (0.05, 0.6), (0.0, 1.5)])
def test_the_variance_is_that_of_simulated_means(noise: float, wave: float) -> None:
    rng = np.random.default_rng(2)
    errors, figures = [], []
    for level in rng.uniform(-3, 3, 400):
        amplitude = wave * rng.uniform(0.8, 1.2)
        signal = noise * rng.normal(size=2000) + amplitude * np.sin(np.arange(2000) * 0.7321 + rng.uniform(0, 6))
        seen = np.round(level + signal)
        errors.append(seen.mean() - level - signal.mean())
        figures.append(codes_of(seen))
    step, deviation = quantisation_std(*np.array(figures).T)
    assert step == 1.0
    real, said = (np.sqrt(np.mean(np.square(values))) for values in (errors, deviation))
    assert 0.8 * real < said < 3.0 * real  # of one data set the noise is known roughly: the figure is on the safe side


def test_data_sets_computed_together_have_the_figures_of_each_alone() -> None:
    """Of several lengths, so that some are computed together: fine, coarse, too short, constant, with a gap, empty."""
    rng = np.random.default_rng(5)
    sets = [rng.normal(size=n) for n in (40, 300, 40, 32, 300, 40, 5)]
    sets += [np.round(rng.normal(size=300) * 3), np.full(300, 2.0), np.array([])]
    sets.append(np.where(np.arange(300) == 7, np.nan, rng.normal(size=300)))
    np.testing.assert_array_equal(figures_of(sets), [codes_of(each) for each in sets])
    spectral = [each for each in sets if len(each) >= 32]
    np.testing.assert_array_equal(white_stds(spectral), [white_std(each) for each in spectral])
    assert len(set(white_stds(spectral[:6]))) == 6


def test_without_noise_it_is_a_twelfth_of_the_step_squared() -> None:
    assert quantisation_variance(0.6, 0.0, 0.0) == pytest.approx(0.6**2 / 12, rel=1e-2)
    assert quantisation_variance(0.6, 2.0, 2.0) == pytest.approx(0.0, abs=1e-12)
    assert quantisation_variance(0.0, 0.0, 0.0) == 0.0


def test_fine_outputs_get_no_column() -> None:
    good = single_axis(1)
    assert not [name for name in to_points(good).columns if name.endswith("_quantisation_std")]
    assert with_quantisation(good) is good


def test_coarse_outputs_carry_what_the_steps_leave() -> None:
    coarse = spoilt(single_axis(1), quantised(5.0))
    means = to_points(coarse).columns["gyro_z_quantisation_std"]
    assert np.median(means) == pytest.approx(5 / np.sqrt(12), rel=0.01)
    readings = with_quantisation(coarse)
    assert np.unique(readings.columns["gyro_z_quantisation_std"]).tolist() == np.unique(means).tolist()
    assert with_quantisation(readings) is readings


def test_one_code_per_data_set_still_shows_the_step() -> None:
    codes = np.array([0.0, 15.0, 25.0, 40.0, -35.0] * 4)
    step, deviation = quantisation_std(np.zeros(20), codes, np.zeros(20), np.zeros(20))
    assert step == pytest.approx(5.0)
    assert deviation == pytest.approx(np.full(20, 5 / np.sqrt(12)), rel=0.01)


def test_outputs_without_noise_that_are_no_codes_have_no_step() -> None:
    rng = np.random.default_rng(1)
    step, _ = quantisation_std(np.zeros(50), rng.normal(size=50), np.zeros(50), np.zeros(50))
    assert step is None
