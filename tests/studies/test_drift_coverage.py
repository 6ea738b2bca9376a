"""The promise until the due date covers units that nothing is known of but their type, from few units on."""

from __future__ import annotations

import pytest

from studies.drift_coverage import Population, by_item, by_type


@pytest.mark.parametrize("noise", [0.1, 0.3])
@pytest.mark.parametrize("mean", [0.0, 1.0, 3.0])
@pytest.mark.parametrize("units", [3, 5, 20])
def test_a_unit_without_a_history_is_covered_by_its_type(units: int, mean: float, noise: float) -> None:
    assert 0.945 <= by_type(Population(mean, noise), units, 2000, 1) <= 0.985


@pytest.mark.parametrize("units", [3, 20])
def test_noise_that_is_taken_for_drift_makes_the_promise_wider_and_not_wrong(units: int) -> None:
    assert by_type(Population(0.0, 1.0, 0.0), units, 1000, 1) >= 0.99


@pytest.mark.parametrize("intervals", [1, 2, 8])
@pytest.mark.parametrize("population", [Population(0.0, 0.1), Population(3.0, 0.3), Population(0.0, 1.0, 0.0)])
def test_a_history_of_its_own_covers_a_drift_also_where_it_is_not_significant(
    intervals: int, population: Population
) -> None:
    assert by_item(population, intervals, 1000, 1) >= 0.97
