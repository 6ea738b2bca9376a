"""A group whose units are all far from the rest of the type is found as a group, and is not lost as outliers."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.fleet.population import population_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients

UNITS, SPREAD, SHIFT = 14, 1e-3, 0.02


@pytest.mark.parametrize("seed", range(4))
def test_a_batch_twenty_spreads_off_is_named_and_none_of_its_units_is_an_outlier(seed: int) -> None:
    draw = np.random.default_rng(seed)
    batches = ("B1", "B2", "B3")
    units = [
        UnitCoefficients(
            f"U{number}", ("x.scale_factor",), np.array([SPREAD * draw.normal() + (SHIFT if number % 3 == 0 else 0.0)]),
            np.array([[1e-11]]), {"batch": batches[number % 3]}, None, ("1",),
        )
        for number in range(UNITS)
    ]  # fmt: skip
    found = population_of(units)
    assert [(each.factor, each.level) for each in found.effects] == [("batch", "B1")]
    assert found.effects[0].shift == pytest.approx(SHIFT, abs=3 * SPREAD)
    assert found.outliers == ()
