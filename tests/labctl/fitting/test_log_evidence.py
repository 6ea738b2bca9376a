"""Evidence of causes with alternatives, by the definition of a mean of Bayes factors."""

from __future__ import annotations

import numpy as np

from labctl.fitting.numeric.log_evidence import mean_evidence, on_all_axes_or_one


def test_a_shape_whose_size_is_not_physical_counts_as_tried() -> None:
    assert np.isclose(np.exp(mean_evidence(np.log([3.0, 5.0, 0.5]), 4)), (3.0 + 5.0 + 0.5) / 4)
    assert np.isclose(mean_evidence(np.array([-np.inf, 2.0]), 2), 2.0 - np.log(2.0))


def test_a_cause_is_on_all_axes_or_on_one_of_them() -> None:
    factors = np.array([[8.0, 1.0], [0.5, 1.0], [4.0, 1.0]])
    expected = 0.5 * factors.prod(axis=0) + factors.sum(axis=0) / 6
    assert np.allclose(np.exp(on_all_axes_or_one(np.log(factors))), expected)
    assert np.isclose(np.exp(on_all_axes_or_one(np.log(factors[:, 0]))), expected[0])


def test_one_axis_is_all_axes() -> None:
    assert on_all_axes_or_one([1.5]) == 1.5
    assert np.array_equal(on_all_axes_or_one([[1.5, -2.0]]), [1.5, -2.0])


def test_a_cause_far_beyond_the_range_of_numbers_keeps_its_evidence() -> None:
    assert np.isclose(float(on_all_axes_or_one([1e5, 2e5])), 3e5 - np.log(2.0))
