"""The test of the lack of fit of readings beside a model that is adequate: NumPy only, nothing of labctl.

`docs/explanation/criticism.md` states it under *Coordinates, noise and lack of fit, in numbers*.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from studies.page_figures_formulas import Law, white_std
from studies.page_figures_recomputed import Sets, about

Array = np.ndarray
#: Time constant of a start transient, s; waves per turn; lines of the steps per turn, which are taken off all others.
START_S, WAVES, LINES = 4.0, (1, 2, 4), (200, 50)
#: A line that is as good as constant is kept; a function of which less is new is left out; parts of a data set.
STEADY, NEW, NODES = 0.3, 0.1, 12
#: Sizes of the drift over what is expected; time constants, s, the first of three equal parts; width of the prior.
SIZES, PRIOR_FACTOR = (0.2, 0.45, 0.7, 1.0, 1.5, 2.3, 3.6, 6.0, 12.0), 2.5
TAUS_S = ((120.0, 700.0, 3600.0), (120.0,), (900.0,), (4000.0,))
#: A drift below this share of the white noise is left out; a robust standard deviation over a median.
NEGLIGIBLE, ROBUST = 0.05, 1.4826
#: Data sets that a scale, and thirds of the rates, need; how much more the fast third has to scatter.
LEAST_SETS, LEAST_THIRD, GROWN = 8, 12, 1.5


@dataclass(frozen=True)
class Reduced:
    """The m data sets of a recording in R coordinates, of which the first is the mean."""

    sets: Sets
    law: Law
    turning_dps: float  #: size of the Earth's rate that goes round with the table

    @cached_property
    def _count(self) -> int:
        """The readings of a data set."""
        counts = set(np.diff(self.sets.begins).tolist())
        assert len(counts) == 1, "data sets of different lengths are not written here"
        return int(counts.pop())

    def _of(self, channel: str) -> Array:
        return self.sets.raw[channel].reshape(-1, self._count)

    @cached_property
    def _basis(self) -> tuple[Array, Array]:
        """Orthonormal functions (R, m, n) over the root of n, and which of them a data set has, (R, m)."""
        since = self._of("t_s") - self._of("t_s")[:, :1]
        angle = np.radians(self._of("table_angle_deg"))
        functions = [wave(k * angle) for k in LINES for wave in (np.cos, np.sin)]
        functions += [np.ones_like(since), since, np.exp(-since / START_S)]
        functions += [wave(k * angle) for k in WAVES for wave in (np.cos, np.sin)]
        lines, found, present = 2 * len(LINES), np.zeros((0, *since.shape)), []
        for k, values in enumerate(functions):
            size = np.linalg.norm(values, axis=1)
            steady = np.abs(values.sum(axis=1)) / np.maximum(size * math.sqrt(self._count), 1e-300)
            left = values
            for _ in range(2):
                left = left - np.einsum("rm,rmn->mn", np.einsum("rmn,mn->rm", found, left), found)
            new = np.linalg.norm(left, axis=1)
            has = new > np.maximum(NEW * size, 1e-9)
            if k < lines:
                has &= steady < STEADY
            found = np.concatenate([found, np.where(has[:, None], left / np.maximum(new, 1e-300)[:, None], 0.0)[None]])
            present.append(has)
        return found[lines:] / math.sqrt(self._count), np.array(present[lines:])

    @cached_property
    def _edges(self) -> Array:
        return np.linspace(0, self._count, NODES + 1).astype(int)[:-1]

    def at_nodes(self, channel: str) -> Array:
        """Return the means of a channel over the parts of each data set, (m, B)."""
        lengths = np.diff(np.append(self._edges, self._count))
        return np.add.reduceat(self._of(channel), self._edges, axis=1) / lengths

    def slow(self, values: Array) -> Array:
        """Return the coordinates (R, m) of values at the nodes (m, B)."""
        return np.einsum("rmb,mb->rm", np.add.reduceat(self._basis[0], self._edges, axis=2), values)

    @cached_property
    def t_s(self) -> Array:
        """The time of each data set, (m,)."""
        return self.at_nodes("t_s").mean(axis=1)

    def errors(self, axis: str) -> Array:
        """Return the coordinates (R, m) of output less true rate."""
        readings = np.einsum("rmn,mn->rm", self._basis[0], self._of(f"gyro_{axis}"))
        return readings - self.slow(np.repeat(self.sets.own_rate_dps[axis][:, None], NODES, axis=1))

    def base(self, axis: str) -> tuple[Array, Array]:
        """Return the columns (R, m, k) of the model and of the once-per-turn rate, and the precision of each (k,)."""
        warm = self.at_nodes("temperature_c")
        rates = np.repeat(np.column_stack([self.sets.own_rate_dps[a] for a in self.law.axes]), NODES, axis=0)
        own = self.law.columns(axis, rates, warm.ravel()).reshape(*warm.shape, -1)
        columns = [self.slow(own[:, :, k]) for k in range(own.shape[2])]
        angle = np.radians(self._of("table_angle_deg"))
        waves = [np.einsum("rmn,mn->rm", self._basis[0], wave(angle)) for wave in (np.cos, np.sin)]
        turning = [np.where(self.sets.position == up, wave, 0.0) for up in np.unique(self.sets.position)
                   if not about(str(up))["xyz".index(axis)] for wave in waves]  # fmt: skip
        precision = np.concatenate([np.zeros(len(columns)), np.full(len(turning), 2 / self.turning_dps**2)])
        return np.stack([*columns, *turning], axis=2), precision

    def white_var(self, axis: str) -> float:
        """Return the variance of a mean by the white noise of a reading, the median over the data sets."""
        return float(np.median([white_std(each) ** 2 for each in self._of(f"gyro_{axis}")])) / self._count

    @property
    def present(self) -> Array:
        """Which coordinates exist, (R, m)."""
        return self._basis[1]


@dataclass(frozen=True)
class Fitted:
    """The base at one drift: its restricted log likelihood with the prior, chi2, and whitened columns (rows, k)."""

    log_p: float
    chi2: float
    base: Array  #: orthonormal
    y: Array  #: (rows,)
    factor: Array  #: of the covariance of the means


@dataclass(frozen=True)
class AxisNoise:
    """One output: its coordinates, the base, the scale of the coordinates (R, m), and the fit at each drift."""

    reduced: Reduced
    axis: str
    scale: Array
    fits: list[Fitted]

    @staticmethod
    def of(reduced: Reduced, axis: str, stability_dps: float) -> AxisNoise:
        """Estimate the scatter of one output, and fit the base at each drift."""
        y, (base, precision) = reduced.errors(axis), reduced.base(axis)
        white = np.full(y.shape[1], reduced.white_var(axis))
        left = _left(y, base, precision, white)
        scale = _scales(left, reduced.present, np.sqrt(white))
        drifts = _drifts(reduced, white + _growing(left[0], reduced.sets, white), stability_dps)
        fits = [_fit(y, base, precision, scale, reduced, covariance, prior) for covariance, prior in drifts]
        return AxisNoise(reduced, axis, scale, fits)

    @property
    def best(self) -> Fitted:
        """The fit at the likeliest drift."""
        return max(self.fits, key=lambda each: each.log_p)

    @property
    def freedom(self) -> int:
        """The degrees of freedom of chi2."""
        return int(self.reduced.present.sum()) - int((self.reduced.base(self.axis)[1] == 0).sum())

    def whitened(self, columns: Array, fit: Fitted) -> Array:
        """Return columns (R, m, q) over the noise at a drift, (rows, q)."""
        rows = _whitened(columns, self.scale, self.reduced.present, fit.factor)
        return np.vstack([rows, np.zeros((len(fit.y) - len(rows), rows.shape[1]))])


def lack_of_fit(axes: list[AxisNoise]) -> tuple[float, int]:
    """Return chi2 over noise and drift of all outputs, and its degrees of freedom."""
    return sum(each.best.chi2 for each in axes), sum(each.freedom for each in axes)


def _drifts(reduced: Reduced, white_var: Array, stability_dps: float) -> Iterator[tuple[Array, float]]:
    """Yield the covariance (m, m) of the means and the log prior at each drift."""
    expected, white = stability_dps / 2, math.sqrt(float(np.median(white_var)))
    lag = np.abs(reduced.t_s[:, None] - reduced.t_s)
    run = np.round(reduced.sets.mean.get("run", 0.0 * reduced.t_s))
    for factor, taus in itertools.product(SIZES, TAUS_S):
        if factor * expected >= NEGLIGIBLE * white or factor == SIZES[-1]:
            together = (run[:, None] == run) * np.mean([np.exp(-lag / tau) for tau in taus], axis=0)
            prior = -0.5 * (math.log(factor) / math.log(PRIOR_FACTOR)) ** 2
            yield (factor * expected) ** 2 * together + np.diag(white_var), prior


def _whitened(columns: Array, scale: Array, present: Array, factor: Array) -> Array:
    """Return columns (R, m, q) with the means over their covariance, and the others over their scale, (rows, q)."""
    others = columns[1:][present[1:]] / scale[1:][present[1:]][:, None]
    return np.vstack([np.linalg.solve(factor, columns[0]), others])


def _fit(
    y: Array, base: Array, precision: Array, scale: Array, reduced: Reduced, covariance: Array, prior: float
) -> Fitted:  # fmt: skip
    """Fit the base to all coordinates: the means by their covariance, the others by their scale."""
    factor = np.linalg.cholesky(covariance)
    rows = _whitened(np.concatenate([base, y[:, :, None]], axis=2), scale, reduced.present, factor)
    known = np.column_stack([np.diag(np.sqrt(precision)), np.zeros(len(precision))])[precision > 0]
    whole = np.vstack([rows, known])
    size = np.linalg.norm(whole[:, :-1], axis=0)
    q, r = np.linalg.qr(whole[:, :-1] / size)
    left = whole[:, -1] - q @ (q.T @ whole[:, -1])
    chi2 = float(left @ left)
    logs = 2 * np.log(np.diag(factor)).sum() + 2 * np.log(np.abs(np.diag(r)) * size).sum()
    return Fitted(-0.5 * (logs + chi2) + prior, chi2, q, whole[:, -1], factor)


def _left(y: Array, base: Array, precision: Array, white_var: Array) -> Array:
    """Return what the base leaves of all coordinates, (R, m), when the means are fitted by their white noise."""
    weight = 1 / np.sqrt(white_var)
    known = np.diag(np.sqrt(precision))[precision > 0]
    columns = np.vstack([base[0] * weight[:, None], known])
    size = np.linalg.norm(columns, axis=0)
    target = np.concatenate([y[0] * weight, np.zeros(len(known))])
    return y - base @ (np.linalg.lstsq(columns / size, target, rcond=None)[0] / size)


def _scales(left: Array, present: Array, white_dps: Array) -> Array:
    """Return the standard deviation of each coordinate, (R, m): one for each kind, robust, at least white noise."""
    scale = np.repeat(white_dps[None, :], len(left), axis=0)
    for k in range(1, len(left)):
        if present[k].sum() >= LEAST_SETS:
            values = left[k, present[k]] / white_dps[present[k]]
            scale[k] *= max(ROBUST * np.median(np.abs(values - np.median(values))), 1.0)
    return scale


def _growing(left_dps: Array, sets: Sets, white_var: Array) -> Array:
    """Return the variance of the means that grows with the rate, (m,), by their scatter about others of their rate."""
    centred, rate = left_dps.copy(), sets.table_rate_dps
    names = np.char.add(sets.position.astype(str), np.round(rate, 2).astype(str))
    for name in np.unique(names):
        centred[names == name] -= np.median(left_dps[names == name])
    speed = np.abs(rate)
    fast, slow = speed > np.quantile(speed, 2 / 3), speed < np.quantile(speed, 1 / 3)
    if min(fast.sum(), slow.sum()) < LEAST_THIRD:
        return 0.0 * white_var
    high, low = (ROBUST * np.median(np.abs(centred[part])) for part in (fast, slow))
    return (high**2 - low**2) * (rate / np.median(speed[fast])) ** 2 if high >= GROWN * low else 0.0 * white_var


def chance_above(chi2: float, freedom: int) -> float:
    """Return the chance that chi-square is larger: one less a series of the chance below, or a continued fraction."""
    half, x = freedom / 2, chi2 / 2
    log = half * math.log(x) - x - math.lgamma(half)
    if x < half + 1:
        term = inside = 1 / half
        for k in itertools.count(1):
            term *= x / (half + k)
            inside += term
            if term < 1e-17 * inside:
                return 1 - inside * math.exp(log)
    tiny, b = 1e-300, x + 1 - half
    c, d = 1 / tiny, 1 / b
    fraction = d
    for k in itertools.count(1):  # Lentz's method
        a, b = -k * (k - half), b + 2
        d, c = 1 / (a * d + b or tiny), b + a / c or tiny
        fraction *= d * c
        if abs(d * c - 1) < 1e-15:
            break
    return fraction * math.exp(log)
