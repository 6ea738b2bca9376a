"""Factors and triangular systems by LAPACK itself: the same numbers as by SciPy, and an error where there are none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import cholesky, solve_triangular

from labctl.fitting.numeric.triangular import lower_factor, solve_lower


@pytest.mark.parametrize("columns", [(), (3,)])
def test_they_are_those_of_scipy(columns: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    some = rng.normal(size=(5, 5))
    matrix, values = some @ some.T + np.eye(5), rng.normal(size=(5, *columns))
    factor = lower_factor(matrix)
    assert np.array_equal(factor, cholesky(matrix, lower=True))
    assert np.array_equal(solve_lower(factor, values), solve_triangular(factor, values, lower=True))


def test_what_has_no_factor_and_no_solution_is_an_error() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="leading minor 2"):
        lower_factor(np.diag([1.0, -1.0]))
    with pytest.raises(np.linalg.LinAlgError, match="element 1"):
        solve_lower(np.diag([0.0, 1.0]), np.ones(2))


def test_of_nothing_they_are_empty() -> None:
    assert lower_factor(np.zeros((0, 0))).shape == (0, 0)
    assert solve_lower(np.eye(2), np.zeros((2, 0))).shape == (2, 0)
