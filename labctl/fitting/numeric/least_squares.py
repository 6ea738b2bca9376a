"""Generalised least squares by QR in scaled columns, averaged over what the noise may be.

Raw Vandermonde columns of rate and temperature have a condition of 1e10; columns centred in temperature and scaled to
unit length have about 1e1 to 1e2 (papers' trap O5), and no normal equations are formed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from labctl.errors import NotEnoughData
from labctl.fitting.numeric import drift_noise
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Drift, Noise, Scatter
from labctl.fitting.numeric.drift_whitening import whitened
from labctl.fitting.numeric.prior_rows import PriorRows
from labctl.fitting.numeric.variance_components import Component, RandomEffects, Triangles, mixture

#: Scaled columns are taken as linearly dependent below this ratio of singular values.
RANK_TOLERANCE = 1e-9
#: Points of the noise grid of which the evidence is less than this share of all are not averaged over.
NEGLIGIBLE = 1e-20
#: The same where the spread of random effects is averaged over at each of them.
NEGLIGIBLE_NOISE = 1e-3
#: The least standard deviation of a random effect, in the unit of its coefficient.
MIN_SPREAD = 1e-9


@dataclass(frozen=True)
class Solution:
    """Coefficients (k,), their covariance (k, k), residuals (m,) and the noise that weighted the data."""

    values: Array
    covariance: NDArray[np.float64]
    residual: Array
    white_dps: float | None  #: of a data-set mean; None when only the total is known
    drift: Drift
    noise: Noise  #: what weighted the data: the same without the factor of what the model lacks
    scale: float  #: factor on the covariance estimated from the residuals; 1 where the white noise is known;
    #: NaN, as the covariance then is, where neither the residuals nor the readings say anything about noise
    components: tuple[Component, ...] = ()  #: spread of each kind of random effect
    along_held: NDArray[np.float64] | None = None  #: (k, h) derivative of the values along h considered columns


@dataclass(frozen=True)
class Considered:
    """Columns of coefficients that are known to an uncertainty, and are not estimated; y is without their part."""

    columns: NDArray[np.float64]  #: (m, h)
    beside: NDArray[np.float64]  #: (m, b): those beside which the noise is estimated
    beside_u: Array  #: (b,) standard uncertainty of the coefficient of each, which is 0; inf: it is free


@dataclass(frozen=True)
class _Fits:
    """The fits at d points of the noise grid, as triangles: whitened columns and data (m, k + 1) reduced to k rows."""

    drifts: Sequence[Drift]
    r: NDArray[np.float64]  #: (d, k, k) upper triangles of the columns
    projected: NDArray[np.float64]  #: (d, k) the data's projection on them
    log_evidence: Array  #: (d,) restricted log likelihoods, with the prior of each drift
    scale: Array  #: (d,) factors on the covariance
    shown: int | None = None  #: so many points are drifts that the scatter between data sets shows

    @property
    def best(self) -> int:
        """The point with the most evidence."""
        return int(np.argmax(self.log_evidence))

    def values(self, point: int) -> Array:
        """Return the coefficients at one point, (k,)."""
        return np.asarray(solve_triangular(self.r[point], self.projected[point], check_finite=False))

    def weights(self) -> Array:
        """Return the share of each point in the evidence, (d,)."""
        weights = np.exp(self.log_evidence - self.log_evidence.max())
        return np.asarray(weights / weights.sum())

    def drift(self) -> Drift:
        """Return the likeliest drift, with a size that is averaged over the points, and the least that it may be.

        Of a drift that the scatter between data sets does not show, no size is stated.
        """
        return self._drift(self.scale[: self.shown])

    def noise(self, scatter: Scatter) -> Noise:
        """Return what weights the data: the drift beside the white noise that is stated, or that the fit leaves."""
        if scatter.white_var is None:
            return Noise(self.drift(), float(np.sqrt(self.scale[self.best])))
        return Noise(self._drift(np.ones_like(self.scale[: self.shown])), float(np.sqrt(scatter.white_var.mean())))

    def _drift(self, scale: Array) -> Drift:
        drifts = self.drifts[: self.shown]
        evidence = self.log_evidence[: self.shown]
        best, weights = int(np.argmax(evidence)), np.exp(evidence - evidence.max())
        weights /= weights.sum()
        found_dps = np.sqrt(scale) * np.array([drift.drift_dps for drift in drifts])
        rising = np.argsort(found_dps)
        least = np.searchsorted(np.cumsum(weights[rising]), 1.0 - drift_noise.MAX_EVIDENCE)
        return Drift(
            float(np.sqrt(np.sum(weights * found_dps**2))),
            drifts[best].tau_s,
            drifts[best].per_rate * float(np.sqrt(scale[best])),
            float(found_dps[rising[least]]),
            drifts[best].shortest_tau_s,
        )


#: Whitened columns and data, (d, m, k + 1) -> triangles (d, k, k), projected data (d, k) and the chi2 left (d,).
_Reduce = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64], Array]]


def _by_qr(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], Array]:
    """Reduce by orthogonal triangles: below the data's projection on the columns stands what is left of them."""
    k = rows.shape[2] - 1
    triangles: NDArray[np.float64] = np.asarray(np.linalg.qr(rows, mode="r"))
    return triangles[:, :k, :k], triangles[:, :k, k], np.sum(triangles[:, k:, k] ** 2, axis=1)


def _by_normal_equations(rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], Array]:
    """Reduce by the Cholesky factors of inner products."""
    gram = rows.transpose(0, 2, 1) @ rows
    factor: NDArray[np.float64] = np.asarray(np.linalg.cholesky(gram[:, :-1, :-1]), dtype=np.float64)
    projected: Array = np.asarray(np.linalg.solve(factor, gram[:, :-1, -1:])[:, :, 0], dtype=np.float64)
    residual_squares = np.maximum(gram[:, -1, -1] - np.sum(projected**2, axis=1), 0.0)
    return factor.transpose(0, 2, 1), projected, np.asarray(residual_squares)


def rank_of(design: NDArray[np.float64]) -> int:
    """Return the rank of a design (m, k) in scaled columns."""
    norms = np.linalg.norm(design, axis=0)
    singular = np.linalg.svd(design / np.where(norms > 0, norms, 1.0), compute_uv=False)
    return int(np.sum(singular > RANK_TOLERANCE * max(singular[0], 1e-300)))


def solve(
    design: NDArray[np.float64],
    y: Array,
    scatter: Scatter,
    drift: Drift | None = None,
    random: RandomEffects | None = None,
    considered: Considered | None = None,
    prior: PriorRows | None = None,
) -> Solution:
    """Fit y (m,) by design (m, k), weighted by the inverse of its noise; `drift` fixes the noise instead of a grid.

    Where the white noise is not known, `drift` is in units of it.
    `prior` is what is known of the k coefficients beside the data; the white noise of the data then has to be known.
    The last columns are `random` effects where that is given; their wide priors are in `prior`. An error of what is
    `considered` is no noise: the noise is estimated beside it, and the coefficients without it.
    Raises NotEnoughData when the columns are linearly dependent or there are fewer rows than columns.
    """
    k = design.shape[1]
    prior = prior or PriorRows.none(k)
    _require_determined(design, scatter, prior)
    whole, known = design, prior
    if considered is not None:
        whole = np.column_stack([design, considered.beside])
        known = prior.with_coefficients(considered.beside_u)
    fits = _at(whole, y, scatter, [drift], known) if drift is not None else _over_grid(whole, y, scatter, known)
    # the triangle of the first columns is that of a fit of them alone
    fits = replace(fits, r=fits.r[:, :k, :k], projected=fits.projected[:, :k])
    solution = _collect(fits, design, y, scatter)
    if random is not None:
        solution = _with_random_effects(solution, fits, design, y, random)
    if considered is None:
        return solution
    rows = np.vstack([prior.rows, _tightened(solution, random, k)])
    return replace(solution, along_held=_along(fits, design, scatter, considered.columns, rows))


def _require_determined(design: NDArray[np.float64], scatter: Scatter, prior: PriorRows) -> None:
    m, k = design.shape
    white_dps = 1.0 if scatter.white_var is None else float(np.sqrt(scatter.white_var.mean()))
    rank = rank_of(np.vstack([design, prior.rows * white_dps]))
    if m + len(prior) < k or rank < k:
        raise NotEnoughData(
            f"{m} data sets at these rates and temperatures determine only {min(m + len(prior), rank)} of the {k} "
            "coefficients of the model; measure at other rates and temperatures, or leave effects out"
        )


def drift_beside(columns: NDArray[np.float64], y: Array, scatter: Scatter) -> Drift:
    """Return the drift that `solve` would find beside orthonormal columns (m, k), many times faster.

    No coefficient is wanted of them, and orthonormal columns, with their part of y taken off, have no condition that
    normal equations could spoil.
    """
    y = y - columns @ (columns.T @ y)
    nothing = PriorRows.none(columns.shape[1])
    return _over_grid(columns, y, scatter, nothing, drift_noise.grid, _by_normal_equations).drift()


def _all_drifts(scatter: Scatter, unexplained_dps: float, per_rate: float = 0.0) -> list[Drift]:
    return [
        *drift_noise.grid(scatter, unexplained_dps, per_rate),
        *drift_noise.hidden(scatter, unexplained_dps, per_rate),
    ]


def _over_grid(
    design: NDArray[np.float64],
    y: Array,
    scatter: Scatter,
    prior: PriorRows,
    drifts: Callable[..., list[Drift]] = _all_drifts,
    reduce: _Reduce = _by_qr,
) -> _Fits:
    """Return the fits over the grid of drifts; with noise that grows with the rate where that is clearly likelier."""
    at = partial(_at, design, y, scatter, prior=prior, reduce=reduce)
    unexplained = _unexplained(design, y, scatter, prior, at([Drift(0.0, 1.0)]).values(0))
    fits = at(drifts(scatter, unexplained))
    growing = _per_rate(design, y, scatter, fits)
    if growing > 0:
        more = at(drifts(scatter, unexplained, growing))
        if more.log_evidence.max() > fits.log_evidence.max() + 3.0:
            fits = more
    return replace(fits, shown=len(drift_noise.grid(scatter, unexplained)))


def _at(
    design: NDArray[np.float64],
    y: Array,
    scatter: Scatter,
    drifts: Sequence[Drift],
    prior: PriorRows,
    reduce: _Reduce = _by_qr,
) -> _Fits:
    """Return the weighted fit and its restricted log likelihood at each drift."""
    has_white = scatter.white_var is not None
    white = scatter.white_var if scatter.white_var is not None else np.ones(len(y))
    rows, log_dets = whitened(scatter, drifts, white, np.column_stack([design, y]))
    r, projected, chi2 = reduce(prior.below(rows))
    log_dets = log_dets + 2 * np.log(np.abs(np.diagonal(r, axis1=1, axis2=2))).sum(axis=1)
    freedom = max(len(y) + len(prior) - design.shape[1], 1)
    # a chi2 above that of the noise is due to the model, and makes its coefficients as much less certain
    scale = np.maximum(chi2 / freedom, 1.0) if has_white else np.maximum(chi2, 1e-300) / freedom
    fit_terms = chi2 if has_white else freedom * np.log(np.maximum(chi2, 1e-300))
    units_dps = np.ones(len(drifts)) if has_white else np.sqrt(scale)
    priors = np.array([drift_noise.log_prior(scatter, *each) for each in zip(drifts, units_dps.tolist(), strict=True)])
    return _Fits(drifts, r, projected, -0.5 * (log_dets + fit_terms) + priors, scale)


def _unexplained(design: NDArray[np.float64], y: Array, scatter: Scatter, prior: PriorRows, values: Array) -> float:
    """Return the scatter that white noise does not explain, deg/s; in units of the white part when that is unknown."""
    residual = y - design @ values
    freedom = max(len(y) + len(prior) - design.shape[1], 1)
    total = float(residual @ residual) / freedom
    largest = scatter.largest_drift_dps / max(drift_noise.DRIFT_SIZES)
    if scatter.white_var is None:
        return float(min(1.0, largest / np.sqrt(max(total, 1e-300))))
    # each data set is weighted by the inverse of its white variance: DerSimonian and Laird 1986, eq. 8
    per_white = 1.0 / scatter.white_var
    off_prior = prior.values - prior.rows @ values
    excess = (float(residual**2 @ per_white) + float(off_prior @ off_prior)) / freedom - 1.0
    unexplained = np.sqrt(max(max(excess, 0.01) / float(per_white.mean()), 1e-24))
    return float(min(unexplained, largest))


def _per_rate(design: NDArray[np.float64], y: Array, scatter: Scatter, fits: _Fits) -> float:
    """Return a robust first guess of the noise that grows with rate: a part of the table's, not of the gyro's."""
    residual = np.abs(y - design @ fits.values(fits.best))
    rate = np.abs(scatter.rate_dps)
    fast = rate > np.quantile(rate, 2 / 3)
    slow = rate < np.quantile(rate, 1 / 3)
    if fast.sum() < 8 or slow.sum() < 8:
        return 0.0
    high, low = 1.4826 * np.median(residual[fast]), 1.4826 * np.median(residual[slow])
    excess = np.sqrt(max(high**2 - low**2, 0.0)) / max(float(np.median(rate[fast])), 1e-12)
    return float(excess if scatter.white_var is not None else excess / np.sqrt(max(fits.scale[fits.best], 1e-300)))


def _collect(fits: _Fits, design: NDArray[np.float64], y: Array, scatter: Scatter) -> Solution:
    """Average the fits over the noise grid by their evidence (law of total variance)."""
    weights = fits.weights()
    counting = np.flatnonzero(~(weights < NEGLIGIBLE))
    r, weights = fits.r[counting], weights[counting]
    identity = np.broadcast_to(np.eye(r.shape[1]), r.shape)
    solved = np.linalg.solve(r, np.concatenate([fits.projected[counting, :, None], identity], axis=2))
    each, inverse = solved[:, :, 0], solved[:, :, 1:]
    values = weights @ each
    # side by side, the square roots of all parts of the covariance
    parts = inverse * np.sqrt(weights * fits.scale[counting])[:, None, None]
    roots = np.column_stack([np.concatenate(list(parts), axis=1), (np.sqrt(weights)[:, None] * (each - values)).T])
    white = None if scatter.white_var is None else float(np.sqrt(scatter.white_var.mean()))
    # as many coefficients as data sets leave no residuals, and so nothing to be uncertain by
    blind = np.nan if white is None and design.shape[0] == design.shape[1] else 1.0
    return Solution(
        values, roots @ roots.T * blind, y - design @ values, white, fits.drift(), fits.noise(scatter),
        float(fits.scale[fits.best]) * blind,
    )  # fmt: skip


def _with_random_effects(
    solution: Solution, fits: _Fits, design: NDArray[np.float64], y: Array, random: RandomEffects
) -> Solution:
    """Return a solution averaged also over the spread of the random effects, which so far is that of wide priors."""
    counting = np.flatnonzero(~(fits.weights() < NEGLIGIBLE_NOISE))
    mixed = mixture(
        Triangles(fits.r[counting], fits.projected[counting], fits.scale[counting], fits.log_evidence[counting]), random
    )
    return replace(
        solution,
        values=mixed.values,
        covariance=mixed.covariance,
        residual=y - design @ mixed.values,
        components=mixed.components,
    )


def _tightened(solution: Solution, random: RandomEffects | None, k: int) -> NDArray[np.float64]:
    """Return what the found spread of each random effect, the last q of k columns, adds to its prior: rows (q, k)."""
    if random is None:
        return np.zeros((0, k))
    spread = np.maximum(np.array([component.value for component in solution.components])[random.kind], MIN_SPREAD)
    rows = np.zeros((len(spread), k))
    rows[:, k - len(spread) :] = np.diag(np.sqrt(np.maximum(spread**-2.0 - random.wide**-2.0, 0.0)))
    return rows


def _along(
    fits: _Fits,
    design: NDArray[np.float64],
    scatter: Scatter,
    columns: NDArray[np.float64],
    prior_rows: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the derivative of the coefficients (k,) along those of columns (m, h), averaged over the noise, (k, h)."""
    m, k = design.shape
    white = scatter.white_var if scatter.white_var is not None else np.ones(m)
    below = np.column_stack([prior_rows, np.zeros((len(prior_rows), columns.shape[1]))])
    weights = fits.weights()
    counting = np.flatnonzero(~(weights < NEGLIGIBLE_NOISE))
    projected = np.zeros((k, columns.shape[1]))
    for point, share in zip(counting.tolist(), weights[counting] / weights[counting].sum(), strict=True):
        rows = whitened(scatter, [fits.drifts[point]], white, np.column_stack([design, columns]))[0][0]
        rows = np.vstack([rows, below])
        size = np.maximum(np.linalg.norm(rows[:, :k], axis=0), 1e-300)
        coordinates, *_ = np.linalg.lstsq(rows[:, :k] / size, rows[:, k:], rcond=1e-12)
        projected -= share * coordinates / size[:, None]
    return projected
