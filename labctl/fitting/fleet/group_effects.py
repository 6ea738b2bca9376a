"""Groups of units that differ from the rest of their type: a batch, a bench, a supplier, or a trend over the date.

The levels of all factors compete as columns of one linear model; the one that explains most is added, and the others
are judged beside it, until none is left that chance would not give. So a batch is not named for the bench that it was
measured on, as long as other batches were measured there. The spread of the units is estimated without what a level
explains. A unit counts no more than `CLIP` standard deviations about the type, so that one unit that is far out makes
no group; where nearly all units of a level lie together, far from the type, they count in full: that is a group, and
not as many outliers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from labctl.fitting.fleet.reml import weighted_fit
from labctl.fitting.fleet.unit_coefficients import UnitTable
from labctl.fitting.numeric.arrays import Array

#: Probability that any group is named of a type without groups, over all coefficients and levels (Bonferroni): half of
#: the 1 % that is stated, since few units may not be normally distributed.
ALARM = 0.005
#: Units of a level without which nothing is said of it, and the same beside it; degrees of freedom of its test.
MIN_UNITS, MIN_BESIDE, MIN_FREEDOM = 2, 3, 3
#: Standard deviations that a unit counts for at most in a group (Huber 1964).
CLIP = 3.0
#: Share of the units of a level that are farther out than `CLIP` on one side, and share within `NEAR` of the way to
#: their median (or `CLIP`) of it, from which on the level is out as a whole.
OUT, TOGETHER, NEAR = 0.75, 0.65, 0.25
#: Units of a level from which on it may be a group although its units are far from each other too.
MIN_SCATTERED = 5
#: Levels that explain a shift so nearly as well, in chi2, are not distinguished from the best one.
NEAR_CHI2 = 9.0
#: Levels named of one coefficient at most, and iterations of the robust fit.
MAX_LEVELS, ITERATIONS = 12, 12
#: Rounds in which the starting medians of the type and of its groups are found beside each other (Tukey 1977).
POLISH = 4
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
    left: Array  #: chi2 that is left beside it


class Levels:
    """The levels of all factors of a table of units, and the date."""

    def __init__(self, table: UnitTable) -> None:
        self._table = table
        self.tested = sum(len(levels) for levels, _ in self._enough().values()) + self._has_dates
        self.dates: Array = np.where(np.isfinite(table.years), table.years, 0.0)

    @property
    def _has_dates(self) -> bool:
        years = self._table.years[np.isfinite(self._table.years)]
        return len(np.unique(years)) > MIN_FREEDOM

    def _enough(self) -> dict[str, tuple[NDArray[np.int64], int]]:
        """Return factor -> the levels with enough units in and beside them, and the number of all levels."""
        levels = {}
        for factor, level in self._table.level.items():
            count = np.bincount(level[level >= 0], minlength=len(self._table.levels[factor]))
            levels[factor] = (np.flatnonzero((count >= MIN_UNITS) & (count.sum() - count >= MIN_BESIDE)), len(count))
        return levels

    def column(self, level: Level) -> Array:
        """Return the regressor of a level, (n,): 1 in it, 0 beside it; of the date the years from their mean."""
        if level.factor == DATE:
            return self.dates
        number = self._table.levels[level.factor].index(level.level)
        return (self._table.level[level.factor] == number).astype(np.float64)

    def tried(self, root: Array, counted: Array, basis: NDArray[np.float64], z: Array | None = None) -> _Tried:
        """Return what each level explains of standardised residuals beside an orthonormal `basis` (n, q).

        `counted` (n,) are the residuals as they count beside a level; with `z` (n,), as they are, the units of a level
        that is far out as a whole count in full for it.
        """
        tried: list[Level] = []
        gain, left = [np.zeros(0)], [np.zeros(0)]
        for factor, (numbers, _) in self._enough().items():
            if not len(numbers):
                continue
            explained, rest = self._of_factor(factor, root, counted, basis, z)
            tried += [Level(factor, self._table.levels[factor][number]) for number in numbers.tolist()]
            gain.append(explained[numbers])
            left.append(rest[numbers])
        if self._has_dates:
            known = np.isfinite(self._table.years)
            centred = np.where(known, self.dates - np.average(self.dates[known], weights=root[known] ** 2), 0.0) * root
            beside = counted - basis @ (basis.T @ counted)
            explained = _explained((centred @ np.column_stack([beside, basis]))[None], np.array([centred @ centred]))
            tried.append(Level(DATE, ""))
            gain.append(explained)
            left.append(beside @ beside - explained)
        return _Tried(tuple(tried), np.concatenate(gain), np.concatenate(left))

    def _of_factor(
        self, factor: str, root: Array, counted: Array, basis: NDArray[np.float64], z: Array | None
    ) -> tuple[Array, Array]:
        """Return the chi2 that each level of a factor explains, and what is left beside it."""
        known, total = self._table.level[factor] >= 0, len(self._table.levels[factor])
        at, weight, of_basis, own = self._table.level[factor][known], root[known], basis[known], counted[known]
        along = basis.T @ counted
        size = np.bincount(at, weight**2, minlength=total)
        share = size / size.sum()
        inner = _sums(at, total, weight, np.column_stack([own - of_basis @ along, of_basis]))
        inner -= share[:, None] * inner.sum(axis=0)
        squares, within = np.full(total, counted @ counted), np.full(total, np.inf)
        added = np.zeros(inner.shape)
        is_group = np.ones(total, dtype=bool)
        if z is not None and np.any(centre := _far_centres(at, z[known], total)):
            is_group = np.isfinite(centre)
            centre = np.where(is_group, centre, 0.0)
            more = _in_full(z[known], centre[at]) - own
            added = _sums(at, total, more, np.column_stack([weight, of_basis]))
            inner[:, 0] += (1.0 - share) * added[:, 0] - np.sum(inner[:, 1:] * added[:, 1:], axis=1)
            squares = squares + np.bincount(at, more * (more + 2.0 * own), minlength=total)
            beside = np.clip(z[known] - centre[at], -CLIP, CLIP) ** 2 - own**2
            within = np.where(centre != 0.0, counted @ counted + np.bincount(at, beside, minlength=total), np.inf)
        explained = np.where(is_group, _explained(inner, size * (1.0 - share)), 0.0)
        return explained, np.minimum(squares - np.sum((along + added[:, 1:]) ** 2, axis=1) - explained, within)

    def in_full(self, z: Array, level: Level) -> Array:
        """Return z (n,) as it counts where a level is judged: clipped, but for the level if it is far out as one."""
        clipped = np.clip(z, -CLIP, CLIP)
        if level.factor == DATE:
            return clipped
        own = self.column(level) > 0
        centre = _far_centres(np.zeros(int(own.sum()), dtype=np.int64), z[own], 1)
        clipped[own] = _in_full(z[own], centre[0])
        return clipped


def _sums(at: NDArray[np.int64], total: int, weight: Array, columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the weighted sums of columns (m, c) over each of `total` levels, (total, c)."""
    sums = [np.bincount(at, weight * column, minlength=total) for column in columns.T]
    return np.asarray(np.column_stack(sums), dtype=np.float64)


def _far_centres(at: NDArray[np.int64], z: Array, total: int) -> Array:
    """Return the median of each level of which nearly all units lie together farther out than `CLIP`, (total,); else 0.

    A few of its units may be far from the others: that they are outliers is found beside the shift of the level. NaN
    where all of its few units are far out and far from each other: they are outliers, and no group.
    """
    centre = np.zeros(total)
    count = np.bincount(at, minlength=total)
    out = np.maximum(np.bincount(at, z > CLIP, minlength=total), np.bincount(at, z < -CLIP, minlength=total))
    for number in np.flatnonzero((out >= OUT * count) & (count >= MIN_UNITS)).tolist():
        own = z[at == number]
        middle = float(np.median(own))
        if np.mean(np.abs(own - middle) <= max(CLIP, NEAR * abs(middle))) >= TOGETHER:
            centre[number] = middle
        elif len(own) < MIN_SCATTERED:
            centre[number] = np.nan
    return centre


def _in_full(z: Array, centre: Array | float) -> Array:
    """Return z clipped to what lies between the type and a centre, and `CLIP` beyond both."""
    return np.asarray(np.clip(z, np.minimum(centre, 0.0) - CLIP, np.maximum(centre, 0.0) + CLIP))


def _explained(inner: NDArray[np.float64], length: Array) -> Array:
    """Return the chi2 that columns explain, (c,), by their products (c, 1 + q) with the residual and with the basis."""
    left = length - np.sum(inner[:, 1:] ** 2, axis=1)
    is_new = left > DEPENDENT * np.maximum(length, 1e-300)
    return np.where(is_new, inner[:, 0] ** 2 / np.where(is_new, left, 1.0), 0.0)


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
    fitted = _medians(y, columns)
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


def _medians(y: Array, columns: NDArray[np.float64]) -> Array:
    """Return the median of the type, and of each group beside it, for each value of y (n,): where a fit starts.

    From the median of all units a group that is far out would be given no weight, and its shift would stay 0.
    """
    groups = [column > 0 for column in columns.T[1:] if np.all((column == 0.0) | (column == 1.0))]
    none = ~np.any(groups, axis=0) if groups else np.ones(len(y), dtype=bool)
    base = none if np.any(none) else np.ones(len(y), dtype=bool)
    fitted = np.full(len(y), np.median(y[base]))
    for _ in range(POLISH if groups else 0):
        for group in groups:
            fitted[group] += np.median((y - fitted)[group])
    return fitted


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
    z = residual * root
    basis, _ = np.linalg.qr(columns * root[:, None])
    tried = levels.tried(root, np.clip(z, -CLIP, CLIP), basis, z)
    freedom = len(residual) - columns.shape[1] - 1
    if not len(tried.gain) or freedom < MIN_FREEDOM:
        return None
    best = int(np.argmax(tried.gain))
    known = float(np.mean(variance * root**2))  # the part that the units' own uncertainties explain is not estimated
    scale = max(float(tried.left[best]) / freedom, known, 1e-12)
    t = float(np.sqrt(tried.gain[best] / scale))
    p_value = min(1.0, tests * 2.0 * float(stdtr(freedom, -t)))
    if p_value > ALARM:
        return None
    beside = levels.tried(root, levels.in_full(z, tried.levels[best]), basis)
    near = np.flatnonzero(beside.gain > tried.gain[best] - NEAR_CHI2 * scale)
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
