"""A group whose units are all far from the rest of the type is found as a group, and is not lost as outliers."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.fitting.fleet.population import Population, population_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients

SPREAD, SHIFT = 1e-3, 0.02


def found_of(seed: int, units: int, size: int, off: dict[int, float]) -> Population:
    """Return what is found of units in batches of some size, some units of which are off by a number of spreads."""
    draw = np.random.default_rng(seed)
    return population_of([
        UnitCoefficients(
            f"U{number}", ("x.scale_factor",), np.array([SPREAD * (draw.normal() + off.get(number, 0.0))]),
            np.array([[1e-11]]), {"batch": f"B{number // size}"}, None, ("1",),
        )
        for number in range(units)
    ])  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("units", "size"), [(12, 2), (12, 3), (14, 5), (36, 5), (200, 20)])
def test_a_batch_twenty_spreads_off_is_named_and_none_of_its_units_is_an_outlier(
    units: int, size: int, seed: int
) -> None:
    found = found_of(seed, units, size, dict.fromkeys(range(size), 20.0))
    assert [(each.factor, each.level) for each in found.effects] == [("batch", "B0")]
    assert found.effects[0].shift == pytest.approx(SHIFT, abs=3 * SPREAD)
    assert found.outliers == ()
    assert 0.5 * SPREAD < found.coefficients[0].spread < 2.0 * SPREAD


@pytest.mark.parametrize(("units", "size", "more"), [(12, 3, 20.0), (36, 5, 20.0), (36, 5, -20.0), (200, 20, -20.0)])
def test_an_outlier_inside_a_batch_that_is_off_is_the_only_outlier(units: int, size: int, more: float) -> None:
    found = found_of(7, units, size, {0: 20.0 + more} | dict.fromkeys(range(1, size), 20.0))
    assert [(each.factor, each.level) for each in found.effects] == [("batch", "B0")]
    assert [each.serial_number for each in found.outliers] == ["U0"]
    assert found.effects[0].shift == pytest.approx(SHIFT, abs=3 * SPREAD)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_one_unit_that_is_far_out_makes_no_group_of_its_batch(size: int) -> None:
    found = found_of(3, 36, size, {0: 20.0})
    assert found.effects == ()
    assert [each.serial_number for each in found.outliers] == ["U0"]


def test_units_of_a_batch_that_are_far_from_each_other_too_are_outliers_and_no_group() -> None:
    found = found_of(4, 36, 2, {0: 15.0, 1: 45.0})
    assert found.effects == ()
    assert {each.serial_number for each in found.outliers} == {"U0", "U1"}


def test_two_batches_that_are_off_by_different_amounts_are_both_named() -> None:
    found = found_of(5, 36, 4, dict.fromkeys(range(4), 20.0) | dict.fromkeys(range(4, 8), -30.0))
    assert {each.level for each in found.effects} == {"B0", "B1"}
    assert found.outliers == ()


def test_a_bench_that_also_measured_one_other_unit_is_not_named_for_the_batch_that_is_off() -> None:
    units = found_of(6, 24, 3, dict.fromkeys(range(3), 20.0)).table
    groups = [{"batch": f"B{i // 3}", "bench": "b1" if i < 4 else f"b{2 + i % 3}"} for i in range(24)]
    found = population_of([
        UnitCoefficients(serial, units.names, units.values[i], units.covariance[i], groups[i])
        for i, serial in enumerate(units.serial_numbers)
    ])  # fmt: skip
    assert [(each.factor, each.level, each.same_as) for each in found.effects] == [("batch", "B0", ())]


def test_a_table_error_of_many_spreads_is_one_shift_of_all_scale_factors() -> None:
    draw, names = np.random.default_rng(8), ("x.scale_factor", "y.scale_factor", "z.scale_factor")
    found = population_of([
        UnitCoefficients(
            f"U{i}", names, SPREAD * draw.normal(size=3) + (SHIFT if i % 4 == 0 else 0.0), 1e-11 * np.eye(3),
            {"bench": f"bench {i % 4}"}, None, ("1",) * 3,
        )
        for i in range(40)
    ])  # fmt: skip
    (effect,) = found.effects
    assert (effect.level, effect.coefficients) == ("bench 0", names)
    assert effect.shift == pytest.approx(SHIFT, abs=SPREAD)
    assert found.outliers == ()
