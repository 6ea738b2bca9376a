"""What outputs of real gyros do to an Allan deviation: filters, vibrations, correlated noise, steps of a converter."""

from __future__ import annotations

from collections.abc import Callable

import allantools
import numpy as np
import pytest
from scipy.signal import butter, lfilter

from labctl.fitting.numeric.allan import Allan, allan, hiding_step
from labctl.fitting.numeric.allan_bounds import is_filtered_white

PERIOD_S = 0.01
#: White noise, deg/s/sqrt(Hz), and the same in the unit of N.
WHITE, WALK = 0.02, 1.2
READING_DPS = WHITE / np.sqrt(PERIOD_S)
Filter = Callable[[np.ndarray], np.ndarray]


def white(seed: int, n: int = 100_000) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, READING_DPS, n)


def noise_of(rates: np.ndarray) -> Allan:
    found = allan(rates, PERIOD_S)
    assert found is not None
    return found


def first_order(readings: float) -> Filter:
    share = -np.expm1(-1 / readings)
    return lambda rates: lfilter([share], [1, share - 1], rates)[1000:]


def moving_average(readings: int) -> Filter:
    return lambda rates: np.convolve(rates, np.ones(readings) / readings, "valid")


def second_order(of_nyquist: float) -> Filter:
    return lambda rates: lfilter(*butter(2, of_nyquist), rates)[1000:]


@pytest.mark.slow
@pytest.mark.parametrize(
    "smooth",
    [first_order(0.5), first_order(5), first_order(30), moving_average(3), moving_average(20), second_order(0.5),
     second_order(0.1), second_order(0.02)],
)  # fmt: skip
@pytest.mark.parametrize("seed", [1, 2])
def test_the_angle_random_walk_of_a_filtered_output_is_that_in_front_of_the_filter(smooth: Filter, seed: int) -> None:
    found = noise_of(smooth(white(seed)))
    figure = found.figures["N"]
    assert figure.value is not None
    assert figure.u is not None
    assert figure.value == pytest.approx(WALK, rel=0.03, abs=2 * figure.u)
    assert np.all(np.isnan(found.model_dps) == (found.tau_s < found.from_s))
    for letter in "BK":
        assert found.figures[letter].value is None


@pytest.mark.parametrize("smooth", [first_order(4), moving_average(12), second_order(0.1)])
def test_it_is_what_allantools_deviations_at_long_averaging_times_give(smooth: Filter) -> None:
    rates = smooth(white(3))
    _, theirs, _, _ = allantools.oadev(rates, rate=1 / PERIOD_S, data_type="freq", taus=[1.28, 2.56])
    by_theirs = 60 * float(np.mean(theirs * np.sqrt([1.28, 2.56])))
    assert noise_of(rates).figures["N"].value == pytest.approx(by_theirs, rel=0.03)


@pytest.mark.slow
def test_the_smoothing_of_a_filter_is_the_mean_distance_of_the_instants_it_weighs() -> None:
    assert noise_of(moving_average(20)(white(1, 400_000))).smoothing_s == pytest.approx(20 * PERIOD_S / 3, rel=0.1)
    assert noise_of(first_order(5)(white(1, 400_000))).smoothing_s == pytest.approx(5 * PERIOD_S, rel=0.1)
    assert noise_of(white(1)).smoothing_s == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("hertz", [0.3, 3.0, 13.0, 47.0])
def test_beside_a_vibration_the_angle_random_walk_or_its_bound_holds_the_truth(hertz: float) -> None:
    for seed in range(4):
        rates = white(seed)
        rates += 0.3 * np.sin(2 * np.pi * hertz * PERIOD_S * np.arange(len(rates)))
        figure = noise_of(rates).figures["N"]
        if figure.value is None:
            assert figure.at_most is not None
            assert figure.at_most > WALK
        else:
            assert figure.u is not None
            assert figure.value == pytest.approx(WALK, abs=3 * figure.u)


def test_correlated_noise_at_long_times_does_not_hide_the_white_noise_before_it() -> None:
    rng = np.random.default_rng(4)
    slow = lfilter([1.0], [1.0, -np.exp(-PERIOD_S / 20.0)], rng.normal(0, 1, 400_000))
    found = noise_of(white(4, 400_000) + 0.01 * slow / slow.std())
    figure = found.figures["N"]
    assert figure.value is not None
    assert figure.u is not None
    assert figure.value == pytest.approx(WALK, abs=3 * figure.u)
    assert figure.u < 0.02 * figure.value


@pytest.mark.parametrize("noise_in_steps", [0.02, 0.1, 0.2, 0.3, 0.45, 0.6, 1.0, 3.0])
@pytest.mark.parametrize("mean_in_steps", [0.0, 0.3, 0.5])
def test_steps_of_the_output_bound_what_they_hide(noise_in_steps: float, mean_in_steps: float) -> None:
    """Rounding adds step^2 / 12 to the noise of each reading, or hides it: never is a bound below the noise."""
    step = READING_DPS / noise_in_steps
    rates = step * np.round(white(5) / step + mean_in_steps)
    found = allan(rates, PERIOD_S)
    if found is None:
        assert noise_in_steps < 0.2  # every reading is the same
        return
    figure = found.figures["N"]
    if figure.value is None:
        assert noise_in_steps < 0.6
        assert found.step_dps == pytest.approx(step)
        assert "steps of" in figure.why
        for each in found.figures.values():
            assert each.at_most is not None
        assert figure.at_most is not None
        assert figure.at_most > WALK
    else:
        assert noise_in_steps > 0.2
        rounded = WALK * np.sqrt(1 + 1 / 12 / noise_in_steps**2)
        assert figure.value == pytest.approx(rounded, rel=0.1 if noise_in_steps < 0.5 else 0.03)


def test_a_repeated_reading_is_no_step_of_the_output() -> None:
    rates = np.repeat(white(6, 20_000), 10)
    assert hiding_step(rates) is None
    figure = noise_of(rates).figures["N"]
    assert figure.value is not None
    assert figure.u is not None
    assert figure.value == pytest.approx(WALK * np.sqrt(10), abs=3 * figure.u)  # each reading stands for ten periods


def test_only_a_filter_lowers_white_noise_as_a_filter_does() -> None:
    tau = PERIOD_S * 2.0 ** np.arange(8)
    x = tau / (4 * PERIOD_S)
    filtered = (1 - (3 - 4 * np.exp(-x) + np.exp(-2 * x)) / (2 * x)) / tau
    assert is_filtered_white(filtered, tau, 1.0)
    assert is_filtered_white(1 / tau, tau, 1.0)
    assert not is_filtered_white(np.where(np.arange(8) < 7, 0.4, 1.0) / tau, tau, 1.0)  # less noise, then more
