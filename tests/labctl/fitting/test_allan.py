"""Allan deviation and the figures of a static record: against published values and noise of known size."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.fitting.criticism.criticism import criticise
from labctl.fitting.criticism.evidence.noise_grid import expected_drift_dps, noise_grid
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.static_record import LONG_S, longest_stretch, static_record
from labctl.fitting.models.presets import preset_for
from labctl.fitting.numeric.allan import Allan, allan, overlapping_variance
from labctl.fitting.numeric.allan_terms import DEG_PER_HOUR, DEG_PER_ROOT_HOUR
from tests.helpers.static_recordings import PERIOD_S, noise, resting, with_record_at_rest

START = datetime(2026, 1, 1, tzinfo=UTC)
K_UNIT = DEG_PER_HOUR * DEG_PER_ROOT_HOUR


def figures(rates: np.ndarray) -> Allan:
    found = allan(rates, PERIOD_S)
    assert found is not None
    return found


def test_published_values_of_the_thousand_points() -> None:
    """NIST SP 1065, section 12.4: 1000 points of a prime modulus generator, overlapping Allan deviation."""
    numbers = [1_234_567_890]
    for _ in range(999):
        numbers.append(16807 * numbers[-1] % 2_147_483_647)
    rates = np.array(numbers) / 2_147_483_647
    for m, published in ((1, 2.922319e-01), (10, 9.159953e-02), (100, 3.241343e-02)):
        assert math.sqrt(overlapping_variance(rates, m)) == pytest.approx(published, rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_white_noise_shows_only_the_angle_random_walk(seed: int) -> None:
    found = figures(noise(seed, 20_000, n_walk=1e-3))
    walk = found.figures["N"]
    assert walk.value is not None
    assert walk.u is not None
    assert abs(walk.value - 1e-3 * DEG_PER_ROOT_HOUR) < 3 * walk.u
    assert walk.u < 0.02 * walk.value
    for letter in "BK":
        other = found.figures[letter]
        assert (other.value, other.u) == (None, None)
        assert "averaging times" in other.why
        assert other.at_most is not None


def test_flicker_and_random_walk_show_their_sizes() -> None:
    found = figures(noise(4, 200_000, n_walk=1e-3, instability=1e-3, rate_walk=8e-5))
    for letter, true in (("N", 1e-3 * DEG_PER_ROOT_HOUR), ("B", 1e-3 * DEG_PER_HOUR), ("K", 8e-5 * K_UNIT)):
        figure = found.figures[letter]
        assert figure.value is not None, letter
        assert figure.u is not None
        assert abs(figure.value - true) < 3 * figure.u, letter
        assert figure.u < 0.2 * true, letter


@pytest.mark.slow
@pytest.mark.parametrize("hours", [1, 8])
def test_a_warm_up_is_taken_off_and_not_read_as_a_random_walk(hours: int) -> None:
    """What a first hour says of longer times does not contradict what the later hours show."""
    t_s = PERIOD_S * np.arange(int(hours * 3600 / PERIOD_S))
    for seed in range(3):
        still = noise(seed, len(t_s), n_walk=0.01, instability=1.5e-3)
        found = figures(still + 0.12 * np.exp(-t_s / 900))
        assert found.trend_dps == pytest.approx(0.12 if hours > 1 else 0.118, abs=0.02)
        assert found.figures["K"].value is None
        assert found.figures["K"].at_most is not None
        walk, flat = found.figures["N"], found.figures["B"]
        assert walk.value == pytest.approx(0.01 * DEG_PER_ROOT_HOUR, rel=0.03)
        assert flat.value == pytest.approx(1.5e-3 * DEG_PER_HOUR, rel=0.3)
        assert figures(still).trend_dps == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("warm_up_dps", [0.0, 0.12])
def test_values_are_within_their_intervals_and_bounds_above_the_truth(warm_up_dps: float) -> None:
    true = {"N": 2e-3 * DEG_PER_ROOT_HOUR, "B": 3e-4 * DEG_PER_HOUR, "K": 3e-5 * K_UNIT}
    within: dict[str, list[bool]] = {letter: [] for letter in true}
    above = []
    t_s = np.arange(28_800.0)  # readings of a second each; noise() has tenths
    for seed in range(40):
        rates = noise(seed, len(t_s), 2e-3 * math.sqrt(PERIOD_S), 3e-4, 3e-5 / math.sqrt(PERIOD_S))
        found = allan(rates + warm_up_dps * np.exp(-t_s / 900), 1.0)
        assert found is not None
        for letter, figure in found.figures.items():
            if figure.value is not None:
                assert figure.u is not None
                within[letter].append(abs(figure.value - true[letter]) <= 2 * figure.u)
            else:
                assert figure.at_most is not None
                above.append(figure.at_most >= true[letter])
    assert all(np.mean(hits) >= 0.85 for hits in within.values())
    assert len(within["K"]) > 30
    assert np.mean(above) >= 0.95


def test_a_deviation_that_follows_no_slope_of_the_standard_has_a_bound_and_no_value() -> None:
    t_s = PERIOD_S * np.arange(72_000)
    wave = 5e-3 * np.sin(2 * np.pi * t_s / 600.0)
    figure = figures(noise(1, len(t_s), n_walk=1e-3) + wave).figures["K"]
    assert figure.value is None
    assert figure.at_most is not None


@pytest.mark.slow
def test_the_interval_holds_the_truth_at_95_percent_of_averaging_times() -> None:
    inside = []
    for seed in range(40):
        found = figures(noise(seed, 4000, n_walk=1e-3))
        true = 1e-3 / np.sqrt(found.tau_s)
        inside.append((found.low_dps <= true) & (true <= found.high_dps))
        assert np.all(found.low_dps < found.deviation_dps)
        assert np.all(found.deviation_dps < found.high_dps)
    assert 0.92 < np.mean(inside) < 0.98


def test_too_few_readings_or_none_that_scatter_have_no_deviation() -> None:
    assert allan(np.zeros(5000), PERIOD_S) is None
    assert allan(noise(1, 200, n_walk=1e-3), PERIOD_S) is None


def test_the_longest_stretch_ends_at_motion_gaps_and_other_temperatures() -> None:
    n = 4000
    rate, t_s, warm = np.zeros(n), PERIOD_S * np.arange(n), np.full(n, 25.0)
    rate[500:600] = 10.0
    t_s[1500:] += 60.0
    warm[2600:] = 40.0
    warm[2600:2650] = np.linspace(25, 40, 50)
    recording = resting(noise(1, n, n_walk=1e-3), table_rate_dps=rate, t_s=t_s, temperature_c=warm)
    rows = longest_stretch(recording)
    assert rows is not None
    assert rows.stop == n
    assert 2640 <= rows.start <= 2650


def test_a_slowly_warming_record_is_cut_to_one_temperature() -> None:
    n = 20_000
    recording = resting(noise(1, n, n_walk=1e-3), temperature_c=np.linspace(20, 30, n))
    rows = longest_stretch(recording)
    assert rows is not None
    assert rows.stop - rows.start == pytest.approx(n / 10, rel=0.02)


def test_means_and_moving_tables_have_no_static_record() -> None:
    assert static_record(resting(noise(1, 1000, n_walk=1e-3), table_rate_dps=np.full(1000, 5.0))) is None
    assert static_record(resting(noise(1, 100, n_walk=1e-3))) is None


def test_a_long_static_record_replaces_the_data_sheet_and_a_short_one_does_not() -> None:
    long, short = (static_record(with_record_at_rest(minutes, 2e-3)) for minutes in (40, 10))
    assert long is not None
    assert short is not None
    assert long.duration_s > LONG_S > short.duration_s
    measured = long.instability_dps("z")
    assert measured == pytest.approx(2e-3, rel=0.3)
    assert short.instability_dps("z") is None
    assert expected_drift_dps("fog", 0.01, measured) == pytest.approx(1.35 * measured)
    assert expected_drift_dps("fog", 0.01, None) == pytest.approx(0.005)
    by_record, by_sheet = noise_grid("fog", 0.01, 1e-4, measured), noise_grid("fog", 0.01, 1e-4)
    likeliest = [max(grid, key=lambda point: point.log_prior).size_dps for grid in (by_record, by_sheet)]
    assert likeliest == pytest.approx([1.35 * measured, 0.005])


def test_a_long_record_among_short_data_sets_is_taken_in_pieces_of_their_length() -> None:
    recording = with_record_at_rest(30, 2e-3)
    data = reduce_recording(recording)
    assert len(data) == 40 + 18000 // 80
    assert data.weights.shape[1] == len(data)
    assert data.dataset[:40].tolist() == list(range(1, 41))
    assert set(data.dataset[40:]) == {41}
    rest = np.asarray(recording.columns["dataset"]) == 41
    assert data.output["z"][0, 40:].mean() == pytest.approx(recording.columns["gyro_z"][rest].mean(), abs=1e-9)
    assert data.at_sets(np.asarray(data.nodes["t_s"]))[40:] == pytest.approx(
        recording.columns["t_s"][rest].reshape(-1, 80).mean(axis=1), abs=PERIOD_S
    )


def test_criticism_weighs_with_the_static_record() -> None:
    recording = with_record_at_rest(30, 2e-3)
    recording = replace(recording, info=recording.info.model_copy(update={"datasheet": {"bias_stability_dps": 1e-5}}))
    model, _ = preset_for(None, ["bias", "scale_factor"]).build(fit_data_of(recording))
    found = criticise(recording, model, full=False)
    assert found.data.static is not None
    assert found.comparison is not None
    smallest = min(noise.size_dps for noise in found.comparison.axes["z"].noises)
    assert smallest > 1e-4  # around 1.35 B, not around half of the data sheet's 1e-5
    assert reduce_recording(recording).static is None


def test_figures_are_in_proportion_to_the_noise() -> None:
    """The fit of the terms once ended at a change of 1e-8 (deg/s)^2, which is all of the noise of a good gyro."""
    rng = np.random.default_rng(1)
    record = rng.normal(0, 0.01, 36_000) + 1e-5 * np.cumsum(rng.normal(size=36_000))
    found = []
    for size in (1.0, 1e-3):
        answer = allan(size * record, 0.1)
        assert answer is not None
        figure = answer.figures["N"]
        assert figure.value is not None
        assert figure.u is not None
        found.append([figure.value / size, figure.u / size])
    assert found[1] == pytest.approx(found[0], rel=1e-6)
