"""The bound of the largest error over outputs and rate vectors, against closed forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import chi, norm

from labctl.fitting.uncertainty.largest_error import COVERAGE_PROBABILITY, widening
from labctl.fitting.uncertainty.vector_bound import PLACES


@dataclass
class Known:
    """The uncertainty at one rate vector, of which only the covariance counts."""

    rates_dps: dict[str, float]
    covariance: np.ndarray
    outputs: tuple[str, ...]


def found(offset: float, slopes: Any, *, outputs: str = "xyz", places: Any = PLACES) -> Any:
    """Return the covariances of e = a + E w, with a and the elements of E independent, at places of a ball of 100."""
    wide = np.asarray(slopes, dtype=np.float64)[["xyz".index(output) for output in outputs]]

    def at(rates: np.ndarray) -> Known:
        covariance = np.diag(offset**2 + wide**2 @ rates**2)
        return Known(dict(zip("xyz", rates, strict=True)), covariance, tuple(outputs))

    return cast(Any, [at(100.0 * np.array(place)) for place in places])


def test_widening_for_one_output_is_the_normal_quantile() -> None:
    alone = found(1.0, np.zeros((3, 3)), outputs="x", places=[(0.0, 0.0, 0.0)])
    assert widening(alone) == pytest.approx(norm.ppf(0.5 * (1 + COVERAGE_PROBABILITY)) / 2.0, rel=0.02)


@pytest.mark.slow
def test_over_all_directions_it_is_that_of_the_length_of_a_vector() -> None:
    """|E w| over the sphere is largest along E, and its length is chi distributed with three degrees of freedom."""
    directions = np.random.default_rng(1).normal(size=(800, 3))
    sphere = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    every = found(0.0, np.full((3, 3), 1e-3), outputs="x", places=np.concatenate([sphere, 0.5 * sphere]))
    assert widening(every) == pytest.approx(chi(3).ppf(COVERAGE_PROBABILITY) / 2.0, rel=0.02)


def test_over_independent_outputs_it_is_that_of_the_largest() -> None:
    every = found(1.0, np.zeros((3, 3)), places=[(0.0, 0.0, 0.0)])
    assert widening(every) == pytest.approx(norm.ppf(0.5 * (1 + COVERAGE_PROBABILITY ** (1 / 3))) / 2.0, rel=0.02)


def test_errors_that_are_one_error_are_not_counted_twice() -> None:
    every = found(1.0, np.zeros((3, 3)), places=[(0.0, 0.0, 0.0)])
    every[0].covariance = np.ones((3, 3))
    assert widening(every) == pytest.approx(norm.ppf(0.5 * (1 + COVERAGE_PROBABILITY)) / 2.0, rel=0.02)


def test_outputs_that_do_not_count_are_left_out() -> None:
    every = found(0.0, np.diag([1e-3, 1e-3, 1e-3]), places=np.eye(3))
    own = widening(every, [["x"], ["y"], ["z"]])
    assert own == pytest.approx(norm.ppf(0.5 * (1 + COVERAGE_PROBABILITY ** (1 / 3))) / 2.0, rel=0.02)


def test_it_is_unknown_where_a_covariance_is() -> None:
    every = found(1.0, np.zeros((3, 3)))
    every[3].covariance[1, 1] = np.nan
    assert np.isnan(widening(every))
