"""A batch that differs from its type: how often it is named as a batch, by its size and shift, beside the optimum.

The fleets are drawn with numpy alone: units that scatter by one spread in each of six coefficients, each calibrated
with an uncertainty of 0.3 spreads, in batches of equal size on three benches. The first batch is shifted in one
coefficient. The optimum is the power of Student's t for a batch that is known beforehand to be the only one that may
differ, at the level that the number of groups and coefficients requires: noncentral F with the noncentrality
s^2 n (1 - n/N) / (1 + 0.3^2). `LABCTL_STUDY_FLEETS` is how many fleets each figure is of,
`LABCTL_STUDY_SEED` the seed.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
from scipy.stats import chi2, f, ncf, ncx2

from labctl.fitting.fleet.group_effects import ALARM
from labctl.fitting.fleet.population import Population, population_of
from labctl.fitting.fleet.unit_coefficients import UnitCoefficients
from studies.report_tables import wilson

FLEETS = int(os.environ.get("LABCTL_STUDY_FLEETS", "100"))
SEED = int(os.environ.get("LABCTL_STUDY_SEED", "36011"))
#: Units of a fleet and of a batch; shifts in spreads of the units; fleets without any shift for each with one.
SIZES, SHIFTS, QUIET = ((12, 2), (12, 3), (36, 5), (200, 20)), (1.0, 2.0, 3.0, 5.0, 20.0), 10
NAMES = tuple(f"{axis}.{kind}" for axis in "xyz" for kind in ("bias", "scale_factor"))
#: Scale factors and biases are tested as two more quantities, and benches as three more groups.
U, BENCHES, QUANTITIES = 0.3, 3, len(NAMES) + 2


def run(fleets: int = FLEETS, seed: int = SEED) -> str:
    """Return the tables."""
    return "\n".join([*_power(fleets, seed), "", *_outlier(fleets, seed), "", *_quiet(fleets, seed), "", *_joint()])


def drawn(rng: np.random.Generator, units: int, size: int, shift: float, outlier: float = 0.0) -> Population:
    """Return what is found of units in batches of `size`, the first of them shifted, its first unit an outlier too."""
    batch, bench = np.arange(units) // size, rng.integers(BENCHES, size=units)
    values = rng.normal(size=(units, len(NAMES))) + U * rng.normal(size=(units, len(NAMES)))
    values[batch == 0, 0] += shift
    values[0, 0] += outlier
    return population_of([
        UnitCoefficients(f"U{i}", NAMES, values[i], U**2 * np.eye(len(NAMES)),
                         {"batch": f"B{batch[i]}", "bench": f"bench {bench[i]}", "supplier": None})
        for i in range(units)
    ])  # fmt: skip


def is_named(found: Population) -> bool:
    """Return whether the batch that differs is named."""
    return any((each.factor, each.level) == ("batch", "B0") for each in found.effects)


def others_named(found: Population) -> bool:
    """Return whether another group is named."""
    return any((each.factor, each.level) != ("batch", "B0") for each in found.effects)


def optimum(units: int, size: int, shift: float) -> float:
    """Return the power of the best test of one batch at the level of the whole type."""
    freedom = units - 2
    limit = float(f.isf(_level(units, size), 1, freedom))
    return float(ncf.sf(limit, 1, freedom, shift**2 * size * (1.0 - size / units) / (1.0 + U**2)))


def _level(units: int, size: int) -> float:
    return ALARM / ((-(-units // size) + BENCHES) * QUANTITIES)


def _power(fleets: int, seed: int) -> Iterator[str]:
    yield "| batch | shift, spreads | named, % | optimum, % | another group, % | fleets with an outlier, % |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for row, (units, size) in enumerate(SIZES):
        for shift in SHIFTS:
            found = [drawn(np.random.default_rng([seed, 1, row, i]), units, size, shift) for i in range(fleets)]
            yield (
                f"| {size} of {units} | {shift:g} | {share(sum(map(is_named, found)), fleets)} "
                f"| {100 * optimum(units, size, shift):.0f} | {100 * sum(map(others_named, found)) / fleets:.1f} "
                f"| {100 * sum(bool(each.outliers) for each in found) / fleets:.1f} |"
            )


def _outlier(fleets: int, seed: int) -> Iterator[str]:
    yield "| batch off by 20 spreads, one unit of it by 20 more | batch named, % | only this unit an outlier, % |"
    yield "| --- | --- | --- |"
    for row, (units, size) in enumerate(SIZES):
        found = [drawn(np.random.default_rng([seed, 2, row, i]), units, size, 20.0, 20.0) for i in range(fleets)]
        alone = sum({each.serial_number for each in one.outliers} == {"U0"} for one in found)
        yield f"| {size} of {units} | {share(sum(map(is_named, found)), fleets)} | {share(alone, fleets)} |"


def _quiet(fleets: int, seed: int) -> Iterator[str]:
    yield "| nothing differs | a group named, % | an outlier, % |"
    yield "| --- | --- | --- |"
    for row, (units, size) in enumerate(SIZES):
        n = fleets * (QUIET if units < 200 else QUIET // 2)
        found = [drawn(np.random.default_rng([seed, 3, row, i]), units, size, 0.0) for i in range(n)]
        groups, outliers = sum(bool(each.effects) for each in found), sum(bool(each.outliers) for each in found)
        yield f"| {units} units in batches of {size} | {share(groups, n)} | {share(outliers, n)} |"


def _joint() -> Iterator[str]:
    """Yield what a joint test of all coefficients would reach at best for 10 of 200 units and 24 coefficients."""
    level, root = ALARM / 26, np.sqrt(10 * 0.95 / (1.0 + U**2))
    yield "| 10 of 200 units, 24 coefficients; shifted by | each coefficient for itself, at best, % | all in one, % |"
    yield "| --- | --- | --- |"
    for count, shift in ((1, 1.5), (1, 2.0), (1, 3.0), (6, 1.0), (12, 1.0), (24, 0.7)):
        one = float(ncx2.sf(chi2.isf(level / 24, 1), 1, (shift * root) ** 2))
        whole = float(ncx2.sf(chi2.isf(level, 24), 24, count * (shift * root) ** 2))
        many = 1.0 - (1.0 - one) ** count
        yield f"| {shift:g} spreads in {count} of them | {100 * many:.0f} | {100 * whole:.0f} |"


def share(count: int, n: int) -> str:
    """Return a share in percent with its 95 % interval."""
    low, high = wilson(count, n)
    return f"{100 * count / n:.1f} ({100 * low:.1f} to {100 * high:.1f}, n = {n})"
