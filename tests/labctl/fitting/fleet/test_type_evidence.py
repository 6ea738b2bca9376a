"""Effects that no single unit shows, by the sums over units; and one small check through the whole criticism."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from labctl.fitting.criticism import CandidateEstimates, EstimatedShape
from labctl.fitting.fleet.shape_evidence import evidence_of
from labctl.fitting.fleet.type_evidence import UnitEvidence, judged, sums_of, type_evidence
from labctl.fitting.fleet.type_sums import TypeSums

UNITS, Z = 200, 2.0
#: Effects with two shapes of one coefficient each; the shapes of the twins are nearly the same.
EFFECTS = ("alone", "twin", "other_twin", "far")
SHAPES = tuple(
    EstimatedShape(effect, f"order {order}", (f"c_{order}",), ("deg/s",), is_exact=False)
    for effect in EFFECTS
    for order in (2, 3)
)
U = 0.01


def overlap() -> np.ndarray:
    """Return the correlation of the regressors: shapes of one effect are alike, and the twins are."""
    same = np.kron(np.eye(4), np.full((2, 2), 0.9)) + 0.1 * np.eye(8)
    same[2:4, 4:6] = same[4:6, 2:4] = np.array([[0.985, 0.89], [0.89, 0.985]])
    return same


def units(
    hidden: Mapping[int, float], seed: int = 1, n: int = UNITS, *, signed: bool = False, bench: str = "",
    spread: float = 0.0,
) -> list[UnitEvidence]:  # fmt: skip
    """Return units with an effect of some z in the shape `hidden`; those of one bench only, or all.

    With a `spread` the size of each unit is drawn: normal about 1 with this standard deviation.
    """
    rng, same, found = np.random.default_rng(seed), overlap(), []
    root = np.linalg.cholesky(same + 1e-9 * np.eye(8))
    for i in range(n):
        of_bench = f"bench {i % 3}"
        sign = rng.choice([-1.0, 1.0]) if signed else 1.0
        sign += spread * rng.normal() if spread else 0.0
        z = root @ rng.normal(size=8)
        if bench in ("", of_bench):
            z = z + sum(sign * size * same[:, shape] for shape, size in hidden.items())
        found.append(UnitEvidence(f"U{i}", {"x": CandidateEstimates(SHAPES, z, np.full(8, U), same)}, of_bench))
    return found


def test_an_effect_that_no_unit_shows_is_named_for_the_type_with_its_size() -> None:
    found = type_evidence(units({0: Z}))
    (effect,) = found.named
    assert effect.group == ("alone",)
    assert effect.is_common
    assert effect.axes == ("x",)
    (size,) = effect.sizes
    assert abs(size.mean - Z * U) < 3 * size.u_mean
    assert size.u_mean == pytest.approx(U / np.sqrt(UNITS), rel=0.2)
    assert effect.rms_unit_z < 2.5
    assert effect.of_bench is None
    assert found.candidates[0].effect == "alone"
    assert found.candidates[0].units == UNITS


def test_sizes_whose_sign_is_each_units_own_are_named_by_their_spread() -> None:
    (effect,) = type_evidence(units({0: Z}, signed=True)).named
    assert effect.group == ("alone",)
    assert not effect.is_common
    assert effect.sizes[0].spread == pytest.approx(Z * U, rel=0.3)


def test_the_evidence_for_sizes_of_each_unit_does_not_fall_with_their_spread() -> None:
    found = [type_evidence(units({0: 0.02}, spread=50.0 * z)) for z in (2.0, 6.0, 20.0, 60.0, 200.0)]
    assert [each.named[0].group for each in found] == [("alone",)] * 5
    evidence = [each.named[0].log_bayes_factor for each in found]
    assert evidence == sorted(evidence)
    assert evidence[0] > 50.0
    assert all(each.noise_ratio < 1.1 and not each.named[0].is_common for each in found)
    spreads = [each.named[0].sizes[0].spread / U for each in found]
    assert spreads == pytest.approx([2.0, 6.0, 20.0, 60.0, 200.0], rel=0.2)


def test_the_evidence_is_the_marginal_likelihood_of_all_estimates() -> None:
    """Against scipy: the density of all estimates, at the noise and the variance of sizes that make it largest."""
    every = units({6: 3.0}, signed=True, n=60)
    values = np.array([each.axes["x"].z for each in every])
    same, column = overlap(), overlap()[:, 6]

    def log_density(noise: float, size: float) -> float:
        covariance = noise * same + size * np.outer(column, column)
        return float(multivariate_normal(np.zeros(8), covariance).logpdf(values).sum())

    nothing = max(log_density(noise, 0.0) for noise in np.linspace(1.0, 4.0, 301))
    varied = max(log_density(noise, size) for noise in (1.0, 1.02, 1.05, 1.1) for size in np.linspace(5.0, 15.0, 101))
    found = evidence_of(sums_of(every).total()["x"]).about_zero[6]
    assert found == pytest.approx(varied - nothing - 0.5 * np.log1p(60), abs=0.3)


def test_shapes_that_are_alike_are_one_group_however_many_units_there_are() -> None:
    (effect,) = type_evidence(units({2: Z}, n=500)).named
    assert set(effect.group) == {"twin", "other_twin"}


def test_two_effects_are_named_one_after_the_other() -> None:
    found = type_evidence(units({0: Z, 6: Z}))
    assert [effect.group for effect in found.named] in ([("alone",), ("far",)], [("far",), ("alone",)])


def test_an_effect_of_the_units_of_one_bench_is_the_benchs() -> None:
    (effect,) = type_evidence(units({0: Z}, bench="bench 1")).named
    assert effect.of_bench == "bench 1"
    assert {each.bench: each.units for each in effect.benches} == {"bench 0": 67, "bench 1": 67, "bench 2": 66}


def test_nothing_is_named_of_types_without_an_effect() -> None:
    assert not any(type_evidence(units({}, seed)).named for seed in range(2, 12))


def test_estimates_that_scatter_more_than_they_state_are_allowed_for() -> None:
    rough = [
        UnitEvidence(u.serial_number, {a: CandidateEstimates(e.shapes, 1.5 * e.z, e.u, e.overlap)
                                       for a, e in u.axes.items()})
        for u in units({})
    ]  # fmt: skip
    found = type_evidence(rough)
    assert found.noise_ratio == pytest.approx(1.5, rel=0.1)
    assert not found.named


def test_sums_of_parts_say_the_same_as_all_units_in_any_order() -> None:
    every = units({0: Z}, n=60)
    parts = TypeSums()
    for begin in (40, 0, 20):
        parts.merge(sums_of(every[begin : begin + 20]))
    together, apart = type_evidence(every), judged(parts)
    assert apart.units == 60
    assert apart.named[0].group == together.named[0].group
    assert apart.named[0].log_bayes_factor == pytest.approx(together.named[0].log_bayes_factor, rel=1e-9)
    assert apart.named[0].sizes[0].mean == pytest.approx(together.named[0].sizes[0].mean, rel=1e-9)


def test_a_shape_that_some_units_lack_counts_by_those_that_have_it() -> None:
    some = units({0: Z})
    few = [
        UnitEvidence(u.serial_number, {"x": CandidateEstimates(e.shapes[2:], e.z[2:], e.u[2:], e.overlap[2:, 2:])})
        for u in some[:150]
        for e in u.axes.values()
    ]
    found = type_evidence([*few, *some[150:]])
    assert next(c.units for c in found.candidates if c.effect == "alone") == 50
    assert found.named[0].group == ("alone",)


def test_too_few_units_say_nothing() -> None:
    found = type_evidence(units({0: 20.0}, n=4))
    assert not found.named
    assert found.reason == "4 units are too few; criticise at least 5 units of the type"
