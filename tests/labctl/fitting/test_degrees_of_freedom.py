"""Degrees of freedom of a standard uncertainty: against drawn variances, and against the GUM's formula."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.numeric.degrees_of_freedom import (
    MAX_FREEDOM,
    combined_freedom,
    expanded_u,
    freedom_of_bounded,
    information_of,
    scatter_by_variances,
    student_factor,
)


@pytest.mark.parametrize(("freedom", "share"), [(3, 0.0), (3, 0.3), (13, 0.5), (13, 1.0)])
def test_a_variance_that_noise_bounds_has_the_freedom_of_its_scatter(freedom: int, share: float) -> None:
    drawn = np.maximum(share, np.random.default_rng(1).chisquare(freedom, 200_000) / freedom)
    assert freedom_of_bounded(freedom, share) == pytest.approx(2 * drawn.mean() ** 2 / drawn.var(), rel=0.03)


def test_a_variance_without_known_noise_has_the_freedom_of_its_residuals() -> None:
    assert freedom_of_bounded(7, 0.0) == pytest.approx(7)


def test_parts_combine_by_welch_and_satterthwaite() -> None:
    total = combined_freedom(np.array([10.0]), [(np.array([4.0]), 5), (np.array([3.0]), 12)])
    assert total == pytest.approx([10.0**2 / (4.0**2 / 5 + 3.0**2 / 12)])
    assert combined_freedom(np.array([1.0]), []) == pytest.approx([MAX_FREEDOM])
    assert expanded_u(np.array([2.0]), np.array([3.0])) == pytest.approx([2 * student_factor(3)])


def test_one_variance_of_independent_residuals_has_as_many_degrees_as_they_exceed_the_parameters() -> None:
    jacobian = np.random.default_rng(2).normal(size=(20, 4))
    information = information_of(jacobian, 3.0 * np.eye(20), [np.eye(20)])
    variance = np.array([3.0])  # of anything that is proportional to it
    freedom = combined_freedom(variance, [], scatter_by_variances(np.array([[1.0]]), information))
    assert freedom == pytest.approx([16])
