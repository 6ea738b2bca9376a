"""What units of a type have in common: groups, outliers, pooled units, and what is left out."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.fleet.findings import OutlierUnit
from labctl.fitting.fleet.population import Population, population_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients

NAMES = tuple(f"{axis}.{kind}" for axis in "xyz" for kind in ("bias", "scale_factor"))
MEAN, SPREAD, U = (np.tile(each, 3) for each in ((0.1, 0.01), (0.2, 1e-3), (0.05, 2e-4)))


def fleet(n: int = 120, seed: int = 1) -> list[UnitCoefficients]:
    """Return units of eight batches on three benches, without any group that differs."""
    rng = np.random.default_rng(seed)
    batch, bench = rng.integers(8, size=n), rng.integers(3, size=n)
    values = MEAN + SPREAD * rng.normal(size=(n, 6)) + U * rng.normal(size=(n, 6))
    return [
        UnitCoefficients(
            f"U{i}", NAMES, values[i], np.diag(U**2),
            {"batch": f"B{batch[i]}", "bench": f"bench {bench[i]}", "supplier": None},
            datetime(2025, 1, 1, tzinfo=UTC) + timedelta(days=int(rng.integers(700))), ("deg/s", "1") * 3,
        )
        for i in range(n)
    ]  # fmt: skip


def shifted(units: list[UnitCoefficients], factor: str, level: str, by: dict[str, float]) -> list[UnitCoefficients]:
    """Return units of which those of a level have other coefficients."""
    step = np.array([by.get(name, 0.0) for name in NAMES])
    return [replace(u, values=u.values + step) if u.groups[factor] == level else u for u in units]


@pytest.fixture(scope="module")
def quiet() -> Population:
    return population_of(fleet())


def test_mean_and_spread_are_those_that_were_drawn(quiet: Population) -> None:
    assert not quiet.effects
    assert not quiet.outliers
    for each, mean, spread in zip(quiet.coefficients, MEAN, SPREAD, strict=True):
        assert abs(each.mean - mean) < 4 * each.u_mean
        assert each.spread_low < spread < each.spread_high
        assert each.units == 120
        assert each.expanded_u_mean == pytest.approx(2.0 * each.u_mean, rel=0.02)


def test_a_table_error_that_all_units_of_a_bench_share_is_the_benchs() -> None:
    by = dict.fromkeys(("x.scale_factor", "y.scale_factor", "z.scale_factor"), 1e-3)
    (effect,) = population_of(shifted(fleet(), "bench", "bench 1", by)).effects
    assert (effect.factor, effect.level, effect.is_of_bench) == ("bench", "bench 1", True)
    assert effect.coefficients == ("x.scale_factor", "y.scale_factor", "z.scale_factor")
    assert abs(effect.shift - 1e-3) < 3 * effect.u
    assert effect.p_value < 1e-6
    assert effect.same_as == ()


def test_a_batch_that_differs_in_one_coefficient_is_named_and_is_no_error_of_a_bench() -> None:
    (effect,) = population_of(shifted(fleet(), "batch", "B3", {"y.bias": 0.5})).effects
    assert (effect.factor, effect.level, effect.coefficients) == ("batch", "B3", ("y.bias",))
    assert not effect.is_of_bench
    assert abs(effect.shift - 0.5) < 3 * effect.u


def test_two_benches_are_not_distinguished_and_both_are_named() -> None:
    units = [u for u in fleet(200) if u.groups["bench"] != "bench 0"]
    by = dict.fromkeys(("x.scale_factor", "y.scale_factor", "z.scale_factor"), 2e-3)
    effect = population_of(shifted(units, "bench", "bench 1", by)).effects[0]
    assert {(effect.factor, effect.level), *effect.same_as} == {("bench", "bench 1"), ("bench", "bench 2")}


def test_a_trend_over_the_date_is_found_and_expected_of_later_units() -> None:
    units = fleet()
    begin = datetime(2025, 1, 1, tzinfo=UTC)
    by_year = np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    ageing = [
        replace(u, values=u.values + by_year * ((u.measured_at or begin) - begin).days / 365.25) for u in units
    ]  # fmt: skip
    found = population_of(ageing)
    (effect,) = found.effects
    assert (effect.factor, effect.coefficients) == ("date", ("x.bias",))
    assert abs(effect.shift - 0.5) < 3 * effect.u
    later = found.expected({}, begin + timedelta(days=1461)) - found.expected({}, begin)
    assert later[0] == pytest.approx(4 * effect.shift, rel=1e-3)


def test_one_wild_unit_is_named_with_its_reason_and_widens_no_spread(quiet: Population) -> None:
    units = fleet()
    units[7] = replace(units[7], values=units[7].values + np.array([0.0, 0.0, 100.0, 0.0, 0.0, 0.0]))
    found = population_of(shifted(units, "batch", "B3", {"y.bias": 0.6}))
    (outlier,) = found.outliers
    assert (outlier.serial_number, outlier.coefficient) == ("U7", "y.bias")
    assert "spreads of the type" in outlier.reason
    assert "standard uncertainty is 0.05 deg/s" in outlier.reason
    assert [(e.factor, e.level) for e in found.effects] == [("batch", "B3")]
    assert found.coefficients[2].spread == pytest.approx(quiet.coefficients[2].spread, rel=0.1)


def test_the_distance_of_an_outlier_is_in_spreads_only_where_the_type_has_one() -> None:
    alike = OutlierUnit("U7", "x.bias_t1", "deg/s/K", 0.02, 1e-6, 0.0, 1.4e-5, 1428.6, 0.0)
    assert alike.reason == (
        "x.bias_t1 = 0.02 deg/s/K is 1428.6 standard uncertainties above the expected 1e-06 deg/s/K; the spread of the "
        "type is 0 deg/s/K, the unit's own standard uncertainty is 1.4e-05 deg/s/K"
    )
    assert "is 200.0 spreads of the type (0.0001 deg/s/K) above" in replace(alike, spread=1e-4).reason


def test_a_fifth_of_wild_units_hides_nothing() -> None:
    rng, units = np.random.default_rng(2), fleet()
    wild = {f"U{i}" for i in rng.choice(120, 24, replace=False)}
    off = np.array([5.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = population_of([replace(u, values=u.values + off) if u.serial_number in wild else u for u in units])
    assert {o.serial_number for o in found.outliers} == wild
    assert found.coefficients[0].spread < 1.3 * SPREAD[0]


def test_a_unit_is_pulled_towards_its_type_by_what_it_is_uncertain_of(quiet: Population) -> None:
    unit = replace(fleet()[0], values=MEAN + SPREAD, covariance=np.diag((np.array([10.0, 0.01] * 3) * SPREAD) ** 2))
    pooled = quiet.pooled(unit)
    assert pooled.values[0] == pytest.approx(quiet.mean[0], abs=0.05 * SPREAD[0])
    assert pooled.values[1] == pytest.approx(unit.values[1], abs=0.01 * SPREAD[1])
    assert pooled.weight[0] < 0.05
    assert pooled.weight[1] > 0.99
    assert np.sqrt(pooled.covariance[0, 0]) == pytest.approx(quiet.coefficients[0].spread, rel=0.05)
    assert np.all(np.diag(pooled.covariance) <= np.diag(unit.covariance) * 1.0001)


def test_a_pooled_unit_is_without_the_error_of_its_bench() -> None:
    by = dict.fromkeys(("x.scale_factor", "y.scale_factor", "z.scale_factor"), 3e-3)
    units = shifted(fleet(), "bench", "bench 1", by)
    found, unit = population_of(units), next(u for u in units if u.groups["bench"] == "bench 1")
    assert found.pooled(unit).values[1] == pytest.approx(unit.values[1] - 3e-3, abs=1e-3)


def test_correlations_of_coefficients_over_units_are_found_and_those_of_chance_are_not(quiet: Population) -> None:
    assert np.max(np.abs(quiet.estimate.correlation - np.eye(6))) < 0.15
    rng = np.random.default_rng(5)
    linked = [replace(u, values=u.values + rng.normal() * np.array([0.4, 0, 0.4, 0, 0, 0])) for u in fleet()]
    assert population_of(linked).estimate.correlation[0, 2] > 0.4


def test_units_that_cannot_be_compared_are_left_out_with_the_reason() -> None:
    units = fleet(20)
    units[0] = replace(units[0], names=NAMES[:5], values=units[0].values[:5], covariance=np.eye(5))
    units[1] = replace(units[1], covariance=np.full((6, 6), np.nan))
    units[2] = replace(units[2], model="another of the rate")
    units[3] = replace(units[3], reference_temperature_c=20.0)
    found = population_of(units)
    assert len(found.table) == 16
    reasons = {each.serial_number: each.reason for each in found.left_out}
    assert "no coefficient z.scale_factor, which most" in reasons["U0"]
    assert "no uncertainty" in reasons["U1"]
    assert "by model another of the rate" in reasons["U2"]
    assert "reference temperature of 20 deg C" in reasons["U3"]


def test_of_a_unit_that_was_calibrated_twice_the_newest_counts() -> None:
    units = fleet(10)
    again = replace(units[0], values=units[0].values + 9.0, measured_at=datetime(2030, 1, 1, tzinfo=UTC))
    table = population_of([again, *units]).table
    assert len(table) == 10
    assert table.values[table.serial_numbers.index("U0")] == pytest.approx(again.values)


def test_too_few_units_are_refused() -> None:
    with pytest.raises(NotEnoughData, match="4 units of the type have the same coefficients; at least 5 are needed"):
        population_of(fleet(4))
