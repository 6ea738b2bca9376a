"""Errors of the places of a magnetometer's record: their shares, and the likelihood by dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.sparse import csr_array

from labctl.fitting.magnetometer.places import MAX_PLACES, Places, Weights
from labctl.fitting.magnetometer.rest_scatter import scatter_of
from labctl.fitting.numeric.degrees_of_freedom import information_of
from labctl.fitting.poses.between_variance import gls, negative_log_restricted_likelihood

#: A way to the first rest, two rests with a way between, and a way after the last.
REST = np.array([0] * 2 + [1] * 3 + [0] * 4 + [2] * 3 + [0] * 2)


def of_readings(places: Places, part: csr_array) -> NDArray[np.float64]:
    """Return a covariance of places (k, k) as one of readings (n, n)."""
    return np.asarray(part.toarray()[np.ix_(places.number, places.number)])


def test_the_error_of_a_way_goes_from_one_rest_to_the_next() -> None:
    places = Places.of(REST)
    shares = places.of_rests.toarray()[places.number]
    assert shares[:5] == pytest.approx(np.tile([1.0, 0.0], (5, 1)))
    assert shares[5:9, 0] == pytest.approx([0.875, 0.625, 0.375, 0.125])
    assert shares[9:] == pytest.approx(np.tile([0.0, 1.0], (5, 1)))
    assert shares.sum(axis=1) == pytest.approx(np.ones(len(REST)))


def test_what_a_way_adds_is_a_bridge_between_rests_and_a_walk_from_one() -> None:
    places = Places.of(REST)
    added = of_readings(places, places.on_way)
    usual = (2 + 4 + 2) / 3  # readings of a way
    s = np.array([1, 3, 5, 7]) / 8
    bridge = np.array([[min(a, b) * (1 - max(a, b)) for a in s] for b in s])
    assert added[5:9, 5:9] == pytest.approx(4 / usual * bridge)
    from_end = np.array([0.75, 0.25])
    assert added[:2, :2] == pytest.approx(2 / usual * np.minimum.outer(from_end, from_end))
    assert added[12:, 12:] == pytest.approx(2 / usual * np.minimum.outer(from_end[::-1], from_end[::-1]))
    still = REST > 0
    assert not added[still].any()
    assert not added[5:9, :2].any()


def test_a_long_record_has_a_bounded_number_of_places() -> None:
    rest = np.repeat(np.arange(60) % 2 * (1 + np.arange(60) // 2), 500)
    places = Places.of(rest)
    assert 300 < places.of_rests.shape[0] <= MAX_PLACES + 60
    for number in (1, 2, 30):
        assert len(np.unique(places.number[rest == number])) == 1


def test_a_place_shares_errors_with_those_of_the_stretches_beside_it_alone() -> None:
    rest = np.repeat(np.arange(6000) % 2 * (1 + np.arange(6000) // 2), 2)
    weights = Weights.of(Places.of(rest), np.array([1.0, 1.0]))
    assert weights.factor.shape == (3, 6000)  # the diagonal and two below it, of 6,000


@pytest.mark.parametrize("rest", [REST, np.repeat([1, 2, 3], 5), np.repeat([0, 1, 0], [3, 4, 3])])
def test_readings_are_weighed_as_by_the_dense_covariance(rest: NDArray[np.int64]) -> None:
    rng, places = np.random.default_rng(1), Places.of(rest)
    columns = rng.normal(size=(len(rest), 3))
    ratios = np.array([2.0, 5.0])
    total = np.eye(len(rest)) + sum(
        ratio * of_readings(places, part) for ratio, part in zip(ratios, places.parts, strict=True)
    )
    weights = Weights.of(places, ratios)
    assert weights.product(columns) == pytest.approx(columns.T @ np.linalg.solve(total, columns))
    assert weights.log_determinant == pytest.approx(np.linalg.slogdet(total)[1])
    some = np.arange(1, len(rest), 2)
    of_some = Weights.of(places.kept(some), ratios).product(columns[some])
    assert of_some == pytest.approx(columns[some].T @ np.linalg.solve(total[np.ix_(some, some)], columns[some]))


def test_the_scatter_is_what_the_dense_likelihood_says() -> None:
    rng = np.random.default_rng(3)
    rest = np.repeat(np.arange(24) % 2 * (1 + np.arange(24) // 2), 6)
    places = Places.of(rest)
    parts = [np.eye(len(rest)), *(of_readings(places, part) for part in places.parts)]
    jacobian = rng.normal(size=(len(rest), 3)) * [1.0, 1e3, 1e-3]
    drawn = rng.multivariate_normal(np.zeros(len(rest)), np.tensordot([1.0, 4.0, 6.0], parts, 1))
    found = scatter_of(jacobian, drawn, places)
    total = np.tensordot(found.variances, parts, 1)
    assert found.information == pytest.approx(information_of(jacobian, total, parts), rel=1e-6)
    assert found.covariance(np.eye(3)) == pytest.approx(gls(jacobian, drawn, total)[1], rel=1e-6)
    assert np.all(found.freedom(np.eye(3)) < len(rest) - 3)

    def negative_log_likelihood(logs: NDArray[np.float64]) -> float:
        return negative_log_restricted_likelihood(jacobian, drawn, np.tensordot(np.exp(logs), parts, 1))

    best = minimize(
        negative_log_likelihood, np.log([1.0, 4.0, 6.0]), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-10}
    )
    assert found.variances == pytest.approx(np.exp(best.x), rel=0.01)


@pytest.mark.slow
def test_the_errors_of_the_fit_are_as_large_as_stated_and_no_larger_where_the_scatter_is() -> None:
    """By the weights u is true, and no larger where the error is; equal weights make errors of three times that u."""
    rng = np.random.default_rng(4)
    rest = np.repeat(np.arange(24) % 2 * (1 + np.arange(24) // 2), 6)
    places = Places.of(rest)
    total = np.eye(len(rest)) + 4 * of_readings(places, places.parts[0])
    jacobian = rng.normal(size=(24, 1))[np.repeat(np.arange(24), 6)]
    root = np.linalg.cholesky(total)  # `multivariate_normal` draws what the processor's linear algebra makes of it
    drawn = [root @ rng.normal(size=len(rest)) for _ in range(200)]
    scatters = [scatter_of(jacobian, each, places) for each in drawn]
    errors = [
        float(np.linalg.solve(product[:1, :1], product[:1, 1])[0])
        for scatter, each in zip(scatters, drawn, strict=True)
        for product in [Weights.of(places, scatter.ratios).product(np.column_stack([jacobian[:, 0], each]))]
    ]
    u = [float(scatter.covariance(np.eye(1))[0, 0]) for scatter in scatters]
    assert abs(np.corrcoef(np.abs(errors), u)[0, 1]) < 0.2
    assert np.std(errors) == pytest.approx(np.sqrt(np.mean(u)), rel=0.2)
    alike = [jacobian[:, 0] @ each / (jacobian[:, 0] @ jacobian[:, 0]) for each in drawn]
    assert np.std(alike) > 2 * np.std(errors)
