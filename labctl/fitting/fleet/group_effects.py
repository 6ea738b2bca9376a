"""Groups of units that differ from the rest of their type: a batch, a bench, a supplier, or a trend over the date.

The levels of all factors compete as columns of one linear model; the one that explains most is added, and the others
are judged beside it, until none is left that chance would not give. So a batch is not named for the bench that it was
measured on, as long as other batches were measured there. The spread of the units is estimated without what a level
explains, and a single unit counts no more than `CLIP` standard deviations.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from labctl.fitting.fleet.spread import weighted_fit
from labctl.fitting.fleet.unit_coefficients import UnitTable
from labctl.fitting.numeric.arrays import Array

#: Probability that any group is named of a type without groups, over all coefficients and levels (Bonferroni): half of
#: the 1 % that is stated, since few units may not be normally distributed.
ALARM = 0.005
#: Units of a level, and beside it, without which nothing is said of the level.
MIN_UNITS = 3
#: Standard deviations that a unit counts for at most in a group (Huber 1964).
CLIP = 3.0
#: Levels that explain a shift so nearly as well, in chi2, are not distinguished from the best one.
NEAR_CHI2 = 9.0
#: Levels named of one coefficient at most, and iterations of the robust fit.
MAX_LEVELS, ITERATIONS = 12, 12
#: A column of which less than this share is left beside those that were found is one of them.
DEPENDENT = 1e-6
DATE = "date"
#: Standard deviation over the median absolute deviation of a normal distribution.
ROBUST = 1.4826
#: Deviations from which on a unit has no part in the mean of its type.
GONE = 8.0
#: Mean square of the standard normal values within `CLIP`.
SQUARE_WITHIN = 0.97334


@dataclass(frozen=True)
class Level:
    """A level of a factor as a regressor, or the trend over the date (level "")."""

    factor: str
    level: str


@dataclass(frozen=True)
class Shift:
    """A level by which a quantity differs from the rest of the type, as the selection found it."""

    level: Level
    t: float  #: of Student, by the spread of the units without it
    p_value: float  #: by chance anywhere among all levels and quantities that were tried
    same_as: tuple[Level, ...]  #: levels that explain it as well


@dataclass(frozen=True)
class RobustFit:
    """Mean and shifts of groups beside which units are judged, and their robust spread."""

    columns: NDArray[np.float64]  #: (n, p), the first of ones
    fitted: Array  #: (n,)
    tau: float
    shifts: tuple[Shift, ...]


@dataclass(frozen=True)
class _Tried:
    """All levels at one step: (c,) each."""

    levels: tuple[Level, ...]
    gain: Array  #: chi2 that each explains
    norm: Array  #: squared length of each column beside those that were found


class Levels:
    """The levels of all factors of a table of units, and the date."""

    def __init__(self, table: UnitTable) -> None:
        self._table = table
        self.tested = sum(len(levels) for levels, _ in self._enough().values()) + self._has_dates
        self.dates: Array = np.where(np.isfinite(table.years), table.years, 0.0)

    @property
    def _has_dates(self) -> bool:
        years = self._table.years[np.isfinite(self._table.years)]
        return len(np.unique(years)) > MIN_UNITS

    def _enough(self) -> dict[str, tuple[NDArray[np.int64], int]]:
        """Return factor -> the levels with enough units in and beside them, and the number of all levels."""
        found = {}
        for factor, level in self._table.level.items():
            count = np.bincount(level[level >= 0], minlength=len(self._table.levels[factor]))
            found[factor] = (np.flatnonzero((count >= MIN_UNITS) & (count.sum() - count >= MIN_UNITS)), len(count))
        return found

    def column(self, level: Level) -> Array:
        """Return the regressor of a level, (n,): 1 in it, 0 beside it; of the date the years from their mean."""
        if level.factor == DATE:
            return self.dates
        number = self._table.levels[level.factor].index(level.level)
        return (self._table.level[level.factor] == number).astype(np.float64)

    def tried(self, root: Array, left: Array, basis: NDArray[np.float64]) -> _Tried:
        """Return what each level explains of a weighted residual `left` (n,) beside an orthonormal `basis` (n, q)."""
        levels: list[Level] = []
        gain: list[Array] = []
        norm: list[Array] = []
        whole = np.column_stack([left - basis @ (basis.T @ left), basis])
        for factor, (numbers, total) in self._enough().items():
            if not len(numbers):
                continue
            known = self._table.level[factor] >= 0
            at, weight = self._table.level[factor][known], root[known]
            size = np.bincount(at, weight**2, minlength=total)
            share = size / size.sum()
            inner = np.column_stack([np.bincount(at, weight * column, minlength=total) for column in whole[known].T])
            inner = (inner - share[:, None] * inner.sum(axis=0))[numbers]
            length = (size - size * share)[numbers]
            levels += [Level(factor, self._table.levels[factor][number]) for number in numbers.tolist()]
            _append(gain, norm, inner, length)
        if self._has_dates:
            known = np.isfinite(self._table.years)
            centred = np.where(known, self.dates - np.average(self.dates[known], weights=root[known] ** 2), 0.0) * root
            levels.append(Level(DATE, ""))
            _append(gain, norm, (centred @ whole)[None], np.array([centred @ centred]))
        none = np.zeros(0)
        return _Tried(tuple(levels), np.concatenate([none, *gain]), np.concatenate([none, *norm]))


def _append(gain: list[Array], norm: list[Array], inner: NDArray[np.float64], length: Array) -> None:
    left = length - np.sum(inner[:, 1:] ** 2, axis=1)
    is_new = left > DEPENDENT * np.maximum(length, 1e-300)
    norm.append(np.where(is_new, left, 0.0))
    gain.append(np.where(is_new, inner[:, 0] ** 2 / np.where(is_new, left, 1.0), 0.0))


def select_shifts(y: Array, variance: Array, levels: Levels, tests: int, offset: Mapping[Level, Array]) -> RobustFit:
    """Return the robust fit of a quantity (n,) of known variances (n,), with the levels that it differs by.

    `tests` are all levels and quantities that are tried; `offset` are the columns of levels that are in it already.
    """
    columns = np.column_stack([np.ones(len(y)), *offset.values()])
    shifts: list[Shift] = []
    while True:
        fitted, tau = robust_fit(y, variance, columns)
        if len(shifts) == MAX_LEVELS:
            break
        shift = _strongest(y - fitted, variance, tau, columns, levels, tests)
        if shift is None:
            break
        shifts.append(shift)
        columns = np.column_stack([columns, levels.column(shift.level)])
    return RobustFit(columns, fitted, tau, tuple(shifts))


def robust_fit(y: Array, variance: Array, columns: NDArray[np.float64]) -> tuple[Array, float]:
    """Return what columns (n, p) fit to y (n,), and the spread beside it, with little weight for units far out.

    A unit counts at most `CLIP` deviations, and beyond `GONE` nothing at all (Hampel 1974).
    """
    fitted = np.full(len(y), np.median(y))
    tau = _robust_spread(y - fitted, variance)
    for _ in range(ITERATIONS):
        size = np.sqrt(variance + tau**2)
        away = np.abs(y - fitted) / size
        counted = np.minimum(away, CLIP) * np.clip((GONE - away) / (GONE - CLIP), 0.0, 1.0) ** (away > CLIP)
        values, _, _ = weighted_fit(fitted + np.sign(y - fitted) * counted * size, size**2, columns)
        moved = columns @ values
        is_close = bool(np.max(np.abs(moved - fitted) / size) < 1e-6)
        fitted, tau = moved, _robust_spread(y - moved, variance)
        if is_close:
            break
    return fitted, tau


def _robust_spread(residual: Array, variance: Array) -> float:
    """Return the spread beside known variances (n,): by the median absolute deviation and one step from it.

    The step takes the root mean square of what is within `CLIP` such deviations: nearly all that n values say of a
    normal distribution, where the median alone wastes two thirds.
    """
    first = ROBUST * float(np.median(np.abs(residual)))
    within = residual[np.abs(residual) <= CLIP * first]
    total = float(np.mean(within**2)) / SQUARE_WITHIN if len(within) else 0.0
    least = 1e-24 if np.all(variance > 0) else 1e-16 * max(float(np.mean(residual**2)), 1e-280)
    return float(np.sqrt(max(total - float(np.median(variance)), least)))


def _strongest(
    residual: Array, variance: Array, tau: float, columns: NDArray[np.float64], levels: Levels, tests: int
) -> Shift | None:
    """Return the level that explains most of a residual (n,); None where chance would explain as much."""
    root = 1.0 / np.sqrt(variance + tau**2)
    left = np.clip(residual * root, -CLIP, CLIP)
    basis, _ = np.linalg.qr(columns * root[:, None])
    tried = levels.tried(root, left, basis)
    freedom = len(residual) - columns.shape[1] - 1
    if not len(tried.gain) or freedom < MIN_UNITS:
        return None
    best = int(np.argmax(tried.gain))
    chi2 = float(left @ left - np.sum((basis.T @ left) ** 2))
    known = float(np.mean(variance * root**2))  # the part that the units' own uncertainties explain is not estimated
    scale = max((chi2 - float(tried.gain[best])) / freedom, known, 1e-12)
    t = float(np.sqrt(tried.gain[best] / scale))
    p_value = min(1.0, tests * 2.0 * float(stdtr(freedom, -t)))
    if p_value > ALARM:
        return None
    near = np.flatnonzero(tried.gain > tried.gain[best] - NEAR_CHI2 * scale)
    same_as = tuple(tried.levels[i] for i in near.tolist() if i != best)
    return Shift(tried.levels[best], t, p_value, same_as)


def heterogeneity(
    y: Array, variance: Array, columns: NDArray[np.float64], level: Mapping[str, NDArray[np.int64]]
) -> Iterator[tuple[str, float, float, int]]:
    """Yield factor, spread of its levels beside that of their units, chi2 of it and levels (DerSimonian, Laird 1986).

    `variance` (n,) is that of y (n,) with the spread of units, `columns` (n, p) are what was found already, `level` the
    number of the level of each unit (n,) by factor, -1 where it is not known.
    """
    values, _, _ = weighted_fit(y, variance, columns)
    residual, weight = y - columns @ values, 1.0 / variance
    for factor, numbers in level.items():
        known = numbers >= 0
        _, at = np.unique(numbers[known], return_inverse=True)
        size = np.bincount(at, weight[known])
        if len(size) < 2:
            continue
        mean = np.bincount(at, (weight * residual)[known]) / size
        chi2 = float(size @ (mean - np.average(mean, weights=size)) ** 2)
        scale = float(size.sum() - (size @ size) / size.sum())
        yield factor, float(np.sqrt(max(chi2 - (len(size) - 1), 0.0) / scale)), chi2, len(size)
