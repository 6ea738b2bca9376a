"""Estimate of a type: each coefficient in turn with its groups, its spread and its outliers; then their correlation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, stdtr, stdtrit

from labctl.fitting.fleet.directions import Direction, directions_of
from labctl.fitting.fleet.findings import CoefficientPopulation, GroupEffect, GroupSpread, OutlierUnit
from labctl.fitting.fleet.group_effects import DATE, Levels, RobustFit, Shift, heterogeneity, robust_fit, select_shifts
from labctl.fitting.fleet.reml import RemlEstimate, reml, weighted_fit
from labctl.fitting.fleet.unit_coefficients import UnitTable
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import student_factor

#: Probability that any unit is called an outlier of a type without any, over all units and coefficients.
OUTLIER_ALARM = 0.01
#: Degrees of freedom of a robust spread per unit, and the least that are taken.
ROBUST_SHARE, MIN_FREEDOM = 0.6, 3
#: Rounds in which outliers and spread are found beside each other.
ROUNDS = 6
#: Coefficients that a common cause shifts differ from a common shift by no more than chance has it, at this level.
CONSISTENT = 1e-3


@dataclass(frozen=True)
class TypeEstimate:
    """What is found of the units of a type."""

    coefficients: tuple[CoefficientPopulation, ...]
    correlation: NDArray[np.float64]  #: (k, k) of the coefficients over units, beside the means of their groups
    effects: tuple[GroupEffect, ...]  #: strongest first
    group_spreads: tuple[GroupSpread, ...]
    outliers: tuple[OutlierUnit, ...]  #: farthest first
    tests: int  #: levels times coefficients that were tried for `effects`


@dataclass(frozen=True)
class _Shared:
    """A level that shifts all coefficients of a direction by the same amount."""

    direction: Direction
    shift: Shift


@dataclass(frozen=True)
class _Settled:
    """A coefficient with its groups, beside which its spread is estimated without outliers."""

    fit: RobustFit
    spread: RemlEstimate
    t: Array  #: (n,) distance of each unit from what the others expect of it, Student's t
    freedom: int  #: of it
    is_out: NDArray[np.bool_]  #: (n,)


def estimate(table: UnitTable) -> TypeEstimate:
    """Return what is found of the units of a table."""
    levels, directions = Levels(table), directions_of(table)
    tests = max(levels.tested * (len(table.names) + len(directions)), 1)
    shared = [each for direction in directions for each in _shared(table, direction, levels, tests)]
    level = OUTLIER_ALARM / 2.0 / max(table.values.size, 1)
    settled: list[_Settled] = []
    effects: list[GroupEffect] = []
    spreads: list[GroupSpread] = []
    outliers: list[OutlierUnit] = []
    for k in range(len(table.names)):
        own = [each for each in shared if k in each.direction.places]
        taken = {each.shift.level: levels.column(each.shift.level) for each in own}
        fit = select_shifts(table.values[:, k], table.variance[:, k], levels, tests, taken)
        each = _settled(table, k, fit, level)
        settled.append(each)
        effects += _own_effects(table, k, each, 1 + len(taken))
        spreads += _group_spreads(table, k, each)
        outliers += _outliers(table, k, each)
    effects += [_shared_effect(table, each, levels) for each in shared]
    return TypeEstimate(
        tuple(_coefficient(table, k, each) for k, each in enumerate(settled)), _correlation(table, settled),
        tuple(sorted(effects, key=lambda each: -each.t)), tuple(spreads),
        tuple(sorted(outliers, key=lambda each: -abs(each.t))), tests,
    )  # fmt: skip


def _shared(table: UnitTable, direction: Direction, levels: Levels, tests: int) -> Iterator[_Shared]:
    """Yield the levels that shift a direction as a whole: the mean more clearly than any member, and all alike."""
    fit = select_shifts(direction.values, direction.variance, levels, tests, {})
    if not fit.shifts:
        return
    own = [select_shifts(table.values[:, k], table.variance[:, k], levels, tests, {}).shifts for k in direction.places]
    for shift in fit.shifts:
        clearest = max((s.t for each in own for s in each if s.level == shift.level), default=0.0)
        if shift.t >= clearest and _are_alike(table, direction, levels.column(shift.level)):
            yield _Shared(direction, shift)


def _are_alike(table: UnitTable, direction: Direction, column: Array) -> bool:
    """Return whether a column's coefficients in the members of a direction differ by no more than by chance."""
    columns = np.column_stack([np.ones(len(column)), column])
    values, variance = [], []
    for k in direction.places:
        fitted, tau = robust_fit(table.values[:, k], table.variance[:, k], columns)
        size = np.sqrt(table.variance[:, k] + tau**2)
        clipped = fitted + np.clip(table.values[:, k] - fitted, -6.0 * size, 6.0 * size)
        fit, covariance, _ = weighted_fit(clipped, size**2, columns)
        values.append(fit[1])
        variance.append(covariance[1, 1])
    weight = 1.0 / np.array(variance)
    chi2 = float(weight @ (np.array(values) - np.average(values, weights=weight)) ** 2)
    return float(chdtrc(len(values) - 1, chi2)) > CONSISTENT


def _with_each_group(wanted: NDArray[np.bool_], columns: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which units count, with all units of a group of which none would: its shift is not known without them."""
    lost = ~np.any(columns[wanted] != 0.0, axis=0)
    return np.asarray(wanted | np.any(columns[:, lost] != 0.0, axis=1))


def _settled(table: UnitTable, k: int, fit: RobustFit, level: float) -> _Settled:
    """Return the spread beside the shifts that were found, without the units that are too far out for it.

    A unit is judged by the spread of the others (externally studentised), at `level` on each side.
    """
    y, variance, columns = table.values[:, k], table.variance[:, k], fit.columns
    p = columns.shape[1]
    t = (y - fit.fitted) / np.sqrt(variance + fit.tau**2)
    wanted = np.abs(t) <= -float(stdtrit(max(ROBUST_SHARE * len(y) - p, MIN_FREEDOM), level))
    kept = np.ones(len(y), dtype=bool)
    for _ in range(ROUNDS):
        wanted = _with_each_group(wanted, columns)
        if int(wanted.sum()) > p + MIN_FREEDOM:
            kept = wanted
        spread = reml(y[kept], variance[kept], columns[kept])
        freedom = max(int(kept.sum()) - p - 1, MIN_FREEDOM)
        t = _studentised(y, variance, columns, spread, kept, freedom)
        wanted = np.abs(t) <= -float(stdtrit(freedom, level))
        if np.array_equal(wanted, kept):
            break
    return _Settled(fit, spread, t, freedom, ~kept)


def _studentised(
    y: Array, variance: Array, columns: NDArray[np.float64], spread: RemlEstimate, kept: NDArray[np.bool_], freedom: int
) -> Array:
    """Return the distance of each unit from what the other units expect of it, (n,)."""
    total = np.maximum(variance + spread.tau**2, 1e-300)
    of_mean = np.einsum("np,pq,nq->n", columns, spread.covariance, columns)
    square = (y - columns @ spread.values) ** 2 / np.maximum(np.where(kept, total - of_mean, total + of_mean), 1e-300)
    # a unit that is among the others widened their spread, as far as that is estimated
    estimated = spread.tau**2 / (spread.tau**2 + float(np.median(variance)) + 1e-300)
    without = np.maximum(1.0 - estimated * (square - 1.0) / freedom, 0.05)
    return np.asarray(np.sign(y - columns @ spread.values) * np.sqrt(np.where(kept, square / without, square)))


def _coefficient(table: UnitTable, k: int, settled: _Settled) -> CoefficientPopulation:
    spread, kept = settled.spread, ~settled.is_out
    u_mean, freedom = float(np.sqrt(spread.covariance[0, 0])), int(kept.sum()) - settled.fit.columns.shape[1]
    return CoefficientPopulation(
        table.names[k], table.units[k], float(spread.values[0]), u_mean, student_factor(freedom) * u_mean, spread.tau,
        spread.low, spread.high, spread.predictive, float(np.sqrt(np.median(table.variance[kept, k]))), int(kept.sum()),
    )  # fmt: skip


def _own_effects(table: UnitTable, k: int, settled: _Settled, first: int) -> Iterator[GroupEffect]:
    """Yield the groups that one coefficient shows alone; their columns begin at `first`."""
    for i, shift in enumerate(settled.fit.shifts, start=first):
        value, variance = settled.spread.values[i], settled.spread.covariance[i, i]
        yield _effect(table, (k,), shift, float(value), float(np.sqrt(variance)))


def _shared_effect(table: UnitTable, shared: _Shared, levels: Levels) -> GroupEffect:
    """Return a shift of a whole direction, with the spread of the direction beside it."""
    direction = shared.direction
    fit = select_shifts(direction.values, direction.variance, levels, 1, {})
    columns = np.column_stack([np.ones(len(direction.values)), levels.column(shared.shift.level)])
    size = np.sqrt(direction.variance + fit.tau**2)
    clipped = fit.fitted + np.clip(direction.values - fit.fitted, -6.0 * size, 6.0 * size)
    spread = reml(clipped, direction.variance, columns)
    return _effect(
        table, direction.places, shared.shift, float(spread.values[1]), float(np.sqrt(spread.covariance[1, 1]))
    )


def _effect(table: UnitTable, places: Sequence[int], shift: Shift, value: float, u: float) -> GroupEffect:
    factor, level = shift.level.factor, shift.level.level
    if factor == DATE:
        members = int(np.isfinite(table.years).sum())
    else:
        members = int(np.sum(table.level[factor] == table.levels[factor].index(level)))
    return GroupEffect(
        factor, level, tuple(table.names[k] for k in places), value, u, table.units[places[0]], members, shift.t,
        shift.p_value, tuple((each.factor, each.level) for each in shift.same_as), factor == "bench",
    )  # fmt: skip


def _group_spreads(table: UnitTable, k: int, settled: _Settled) -> Iterator[GroupSpread]:
    kept = ~settled.is_out
    total = table.variance[kept, k] + settled.spread.tau**2
    level = {factor: each[kept] for factor, each in table.level.items()}
    for factor, between, chi2, n in heterogeneity(table.values[kept, k], total, settled.fit.columns[kept], level):
        yield GroupSpread(factor, table.names[k], between, n, float(chdtrc(n - 1, chi2)))


def _outliers(table: UnitTable, k: int, settled: _Settled) -> Iterator[OutlierUnit]:
    expected = settled.fit.columns @ settled.spread.values
    for i in np.flatnonzero(settled.is_out).tolist():
        t = float(settled.t[i])
        yield OutlierUnit(
            table.serial_numbers[i], table.names[k], table.units[k], float(table.values[i, k]), float(expected[i]),
            settled.spread.tau, float(np.sqrt(table.variance[i, k])), t,
            min(1.0, 2.0 * table.values.size * float(stdtr(settled.freedom, -abs(t)))),
        )  # fmt: skip


def _correlation(table: UnitTable, settled: Sequence[_Settled]) -> NDArray[np.float64]:
    """Return the correlation (k, k) of the coefficients over units, beside what their calibrations have in common.

    It is shrunk towards none by as much as chance explains of all correlations together (Schaefer and Strimmer 2005):
    few units of many coefficients would else seem to have directions without any spread.
    """
    k, tau = len(settled), np.array([each.spread.tau for each in settled])
    residual = np.column_stack(
        [
            np.where(each.is_out, 0.0, table.values[:, i] - each.fit.columns @ each.spread.values)
            for i, each in enumerate(settled)
        ]
    )
    size = np.where(tau > 0, tau, np.inf)  # what does not differ from unit to unit is correlated with nothing
    joint = (residual.T @ residual / len(table) - table.covariance.mean(axis=0)) / np.outer(size, size)
    share = np.maximum(tau**2 / np.maximum(tau**2 + table.variance.mean(axis=0), 1e-300), 1e-6)
    weight = np.outer(share, share) * (1.0 - np.eye(k))  # what is seen worse counts less
    by_chance, observed = float(weight.sum()) / len(table), float(np.sum((weight * joint) ** 2))
    kept = max(1.0 - by_chance / observed, 0.0) if observed > 0 else 0.0
    shrunk = np.clip(kept * joint, -0.99, 0.99)
    shrunk[np.diag_indices(k)] = 1.0
    values, vectors = np.linalg.eigh((shrunk + shrunk.T) / 2)
    positive = (vectors * np.maximum(values, 1e-6)) @ vectors.T
    root = np.sqrt(np.diag(positive))
    return np.asarray(positive / np.outer(root, root))
