"""Ageing of a type by units that were calibrated more than once."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.fleet.ageing import ageing_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients

U = 0.05


def calibrations(units: int, mean: float, spread: float, seed: int = 1) -> list[UnitCoefficients]:
    """Return two to four calibrations of each unit over years; the bias ages, by a rate of each unit."""
    rng, found = np.random.default_rng(seed), []
    for i in range(units):
        rate, start = rng.normal(mean, spread), rng.normal()
        for year in np.sort(rng.uniform(0, 4, rng.integers(2, 5))).tolist():
            value = start + rate * year + rng.normal(0, U)
            day = datetime(2022, 1, 1, tzinfo=UTC) + timedelta(days=365.25 * year)
            found.append(UnitCoefficients(f"U{i}", ("x.bias",), np.array([value]), np.array([[U**2]]), {}, day))
    return found


def test_mean_and_spread_of_the_rates_are_those_that_were_drawn_and_errors_of_calibrations_are_no_drift() -> None:
    (ageing,) = ageing_of(calibrations(60, 0.3, 0.1))
    assert abs(ageing.mean - 0.3) < 3 * ageing.u_mean
    assert ageing.spread_low < 0.1 < ageing.spread_high
    assert ageing.predictive_u == pytest.approx(np.hypot(ageing.spread, ageing.u_mean))
    (steady,) = ageing_of(calibrations(60, 0.0, 0.0))
    assert steady.spread_low == 0.0
    assert steady.spread < 0.02


def test_a_unit_that_ages_otherwise_is_named_and_does_not_widen_the_type() -> None:
    fast = [
        UnitCoefficients("FAST", ("x.bias",), np.array([9.0 * k]), np.array([[U**2]]), {},
                         datetime(2022 + k, 1, 1, tzinfo=UTC))
        for k in range(3)
    ]  # fmt: skip
    (ageing,) = ageing_of([*calibrations(40, 0.3, 0.1), *fast])
    assert ageing.fast_units == ("FAST",)
    assert ageing.spread < 0.2


def test_too_few_histories_are_refused() -> None:
    with pytest.raises(NotEnoughData, match="2 units of the type were calibrated more than once"):
        ageing_of(calibrations(2, 0.3, 0.1))
