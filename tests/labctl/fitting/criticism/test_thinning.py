"""Cells unite only what cannot be distinguished, and thinning leaves some of everything."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.criticism.diagnostics.channels import drawn_rows
from labctl.fitting.data.levels import rate_levels, temperature_rows


def test_up_to_a_few_thousand_data_sets_all_are_drawn() -> None:
    n = 3000
    rows = drawn_rows(np.full(n, "x"), np.linspace(-400, 400, n), np.linspace(-40, 60, n))
    assert rows.tolist() == list(range(n))


@pytest.mark.parametrize("order", ["by sign", "random"])
def test_thinning_takes_alike_from_every_position_rate_and_temperature(order: str) -> None:
    levels = np.array([0, *(sign * rate for rate in (1, 10, 50, 100, 400) for sign in (1, -1))], dtype=float)
    grid = np.array([(p, r, t) for p in range(3) for t in range(-40, 70, 10) for r in levels for _ in range(30)])
    if order == "random":
        grid = np.random.default_rng(1).permutation(grid)
    rows = drawn_rows(np.array(["x", "y", "z"])[grid[:, 0].astype(int)], grid[:, 1], grid[:, 2], 2000)
    assert len(rows) == 2000
    _, per_rate = np.unique(grid[rows, :2], axis=0, return_counts=True)
    assert len(per_rate) == 33
    assert np.ptp(per_rate) <= 1
    _, per_cell = np.unique(grid[rows], axis=0, return_counts=True)
    assert len(per_cell) == len(np.unique(grid, axis=0))


def test_thinning_of_rates_that_all_differ_keeps_signs_and_temperatures_even() -> None:
    random = np.random.default_rng(2)
    rate, warm = random.uniform(-400, 400, 10000), random.uniform(-40, 60, 10000)
    rows = drawn_rows(np.full(10000, "x"), rate, warm, 1000)
    for values, edges in ((rate, np.linspace(-400, 400, 9)), (warm, np.linspace(-40, 60, 9))):
        counts, _ = np.histogram(values[rows], edges)
        assert counts.min() > 85


def test_rates_are_one_level_within_a_thousandth_and_no_further() -> None:
    rates = np.array([0.0, 0.0005, 0.1, 0.11, 399.9, 400.0, -400.0, 398.0])
    assert rate_levels(rates).tolist() == [1, 1, 2, 3, 5, 5, 0, 4]


def test_temperatures_of_one_cell_are_never_united_beyond_what_a_thermometer_repeats() -> None:
    place, one_rate = np.full(6, "x"), np.zeros(6, dtype=np.int64)
    drifting = np.array([20.0, 20.1, 20.9, 40.0, 40.1, 40.2])
    assert temperature_rows(drifting, place, one_rate).tolist() == [0, 0, 1, 2, 2, 2]
    each_rate_once = np.array([0, 1, 2, 0, 1, 2])
    assert temperature_rows(drifting, place, each_rate_once).tolist() == [0, 0, 0, 1, 1, 1]
