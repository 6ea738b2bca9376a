"""Evidence for shifts that are draws: the marginal likelihood by definition, and what it says of their size."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import logsumexp

from labctl.fitting.criticism.evidence.drawn_shifts import DrawnShifts, reproduced_by_draws, size_average_nats

G = 600.0


def normal_log_density(y: NDArray[np.float64], covariance: NDArray[np.float64]) -> float:
    factor = np.linalg.cholesky(covariance)
    white = np.linalg.solve(factor, y)
    return float(-0.5 * white @ white - np.log(np.diag(factor)).sum())


def indicators(runs: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the columns of the shifts of all runs but the first, beside a constant that the base has taken."""
    columns = np.column_stack([(runs == number).astype(float) for number in np.unique(runs)[1:]])
    return columns - columns.mean(axis=0)


def evidence(runs: NDArray[np.int64], y: NDArray[np.float64]) -> float:
    columns = indicators(runs)
    return float(DrawnShifts.of(columns.T @ columns, G).log_bf(columns.T @ y))


def test_it_is_the_marginal_likelihood_averaged_over_the_size_of_equal_draws() -> None:
    rng = np.random.default_rng(3)
    runs = np.repeat([1, 2, 3, 4], [12, 5, 9, 14])
    columns = indicators(runs)
    y = rng.normal(size=40)
    y -= y.mean()
    found = DrawnShifts.of(columns.T @ columns, G)
    every = np.column_stack([(runs == number).astype(float) for number in range(1, 5)])
    every -= every.mean(axis=0)  # the first run's shift is a draw like the others
    each = [
        normal_log_density(y, np.eye(40) + variance * every @ every.T) - normal_log_density(y, np.eye(40))
        for variance in found.variances
    ]
    assert float(found.log_bf(columns.T @ y)) == pytest.approx(float(logsumexp(each) - np.log(len(each))), rel=1e-9)


def test_runs_without_shifts_count_against_them() -> None:
    """Shifts of another recording without any are evidence that those of the first were none."""
    runs = np.repeat([1, 2, 3], 50)
    shifted = np.array([-0.5, 0.0, 0.5])[runs - 1]
    more = np.repeat(np.arange(4, 12), 50)
    alone = evidence(runs, shifted)
    together = evidence(np.concatenate([runs, more]), np.concatenate([shifted, np.zeros(len(more))]))
    assert alone > 3.0
    assert together < alone - 1.0


def test_what_the_base_has_taken_says_nothing() -> None:
    assert float(DrawnShifts.of(np.zeros((2, 2)), G).log_bf(np.zeros(2))) == pytest.approx(0.0)


def test_an_effect_whose_size_is_averaged_over_has_the_evidence_of_a_draw() -> None:
    """One coefficient, beside one draw with the same column: with one prior of the size the data cannot choose."""
    column, rng = np.repeat([0.0, 1.0], 300), np.random.default_rng(8)
    column -= column.mean()
    gram = np.array([[column @ column / 2.0]])  # a shift less the first one, whose variance is twice that of a draw
    for size in (0.05, 0.3, 2.0):
        product = float(column @ (size * column + rng.normal(size=600)))
        gain = product**2 / float(column @ column)
        by_draws = float(DrawnShifts.of(gram, G).log_bf(np.array([product / np.sqrt(2.0)])))
        unit_information = 0.5 * gain * G / (1 + G) - 0.5 * np.log1p(G)
        averaged = unit_information + size_average_nats(np.array(gain), np.array(1), G)
        assert float(averaged) == pytest.approx(by_draws, abs=1e-9)


def test_the_average_over_sizes_of_many_small_coefficients_is_far_above_one_large_size() -> None:
    small, large = size_average_nats(np.array([37.8, 6000.0]), np.array([6, 6]), G)
    assert small > 8.0  # of chi2 37.8 in six directions a unit-information prior says that there is nothing
    assert abs(large) < 2.5  # each coefficient as large as the prior has it: one of twelve sizes is right
    assert size_average_nats(np.array(5.0), np.array(0), G) == pytest.approx(
        float(logsumexp(0.5 * 5.0 * (g := np.geomspace(1, G, 12)) / (1 + g)) - np.log(12) - 2.5 * G / (1 + G))
    )


def test_it_takes_many_products_at_once() -> None:
    rng = np.random.default_rng(4)
    columns = indicators(np.repeat([1, 2, 3], 10))
    products = rng.normal(size=(7, 2))
    found = DrawnShifts.of(columns.T @ columns, G)
    assert found.log_bf(products) == pytest.approx([float(found.log_bf(each)) for each in products])


def test_shifts_still_to_come_are_drawn_as_large_as_those_that_were_seen() -> None:
    rng = np.random.default_rng(5)
    true_dps, known = 2e-3, 1e8  # each run is known to 1e-4 deg/s
    runs, more = 40, 3
    shifts = true_dps * rng.standard_normal(runs)
    gram = np.zeros((runs - 1 + more, runs - 1 + more))
    gram[: runs - 1, : runs - 1] = known * (np.eye(runs - 1) - 1.0 / runs)  # beside a constant
    products = gram @ np.concatenate([shifts[1:] - shifts[0], np.zeros(more)])
    draws = DrawnShifts.of(gram, G).draw(products, 4000, rng)
    seen, new = draws[:, : runs - 1], draws[:, runs - 1 :]
    np.testing.assert_allclose(seen.mean(axis=0), shifts[1:] - shifts[0], atol=3e-4)
    between = new[:, 0] - new[:, 1]  # two draws, without the first run's
    assert np.std(between) == pytest.approx(np.sqrt(2.0) * true_dps, rel=0.3)


def share_by_draws(runs: NDArray[np.int64], signal: NDArray[np.float64], number: int) -> float:
    columns, signal = indicators(runs), signal - signal.mean()
    return reproduced_by_draws(columns.T @ columns, columns.T @ signal, number) / float(signal @ signal)


def test_gravity_that_one_mounting_alone_turns_up_is_one_draw() -> None:
    runs = np.repeat([1, 2, 3], [40, 50, 60])
    for up in (1, 2, 3):
        assert share_by_draws(runs, 0.3 * (runs == up), 1) == pytest.approx(1.0)
    assert share_by_draws(runs, np.array([0.0, 1.0, -0.4])[runs - 1], 1) < 0.95
    assert share_by_draws(runs, np.array([0.0, 1.0, -0.4])[runs - 1], 2) == pytest.approx(1.0)


def test_gravity_that_an_inverted_mounting_turns_down_is_two_draws() -> None:
    """Six mountings with a coefficient each reproduce it, but two of them have to be equal and opposite."""
    runs = np.repeat(np.arange(1, 7), 20)
    force_g = np.array([1.0, -1.0, 0.0, 0.0, 0.0, 0.0])[runs - 1]
    assert share_by_draws(runs, force_g, 1) < 0.7
    assert share_by_draws(runs, force_g, 2) == pytest.approx(1.0)
    assert share_by_draws(runs, force_g, 9) == pytest.approx(1.0)


def test_draws_are_found_by_definition_beside_a_base_that_takes_a_part_of_them() -> None:
    """The best single draw is the best of all fits of one column: of a run alone, or of all but the first."""
    rng = np.random.default_rng(6)
    runs = np.repeat(np.arange(1, 6), [7, 9, 3, 12, 5])
    every = np.column_stack([(runs == number).astype(float) for number in range(1, 6)])
    base = np.linalg.qr(np.column_stack([np.ones(36), rng.normal(size=(36, 2))]))[0]
    every, signal = (each - base @ (base.T @ each) for each in (every, rng.normal(size=36)))
    by_hand = max(float((column @ signal) ** 2 / (column @ column)) for column in every.T)
    assert reproduced_by_draws(every[:, 1:].T @ every[:, 1:], every[:, 1:].T @ signal, 1) == pytest.approx(by_hand)


def test_a_shift_that_is_not_seen_reproduces_nothing() -> None:
    assert reproduced_by_draws(np.zeros((2, 2)), np.zeros(2), 2) == 0.0
